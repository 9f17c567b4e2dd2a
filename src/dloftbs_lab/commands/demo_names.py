"""Names of the files in the demo's folder."""

INPUT, OVERLAY, CURVES, SHEET = "input.mp4", "overlay.mp4", "curves.jsonl", "contact_sheet.png"
SUMMARY, README, INDEX = "summary.json", "README.txt", "index.html"
