"""One run looked at: numbers, pictures, pages, files for other programs."""
