"""What maps, charts and sheets are drawn with: canvases of PNG, PDF and SVG, marks, hatching, letters."""
