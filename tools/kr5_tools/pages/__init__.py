"""What all pages and plots share."""
