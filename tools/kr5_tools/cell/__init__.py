"""The description of a cell, checked and shown: `kr5 cell`."""
