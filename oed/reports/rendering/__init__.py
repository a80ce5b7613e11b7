"""Pages and pictures as files: HTML, plotly, matplotlib, numbers, colours."""
