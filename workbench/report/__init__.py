"""What every report is built from: drawings as SVG, numbers for people, templates."""
