"""A path checked with pencil and paper: the sheet, the drawing, its scan, its errors."""
