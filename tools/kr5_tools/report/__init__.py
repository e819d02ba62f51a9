"""The page of any result file: `kr5 report`."""
