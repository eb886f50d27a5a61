"""What maps, charts and sheets are drawn with: inks of PNG, PDF and SVG, marks, hatching, letters."""
