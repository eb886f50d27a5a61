"""Scanners: their data sheets, modes, beams of a scan, range noise."""

#: What is planned with where nobody names a scanner: one that crews have, at the spacing that surveys are scanned at.
DEFAULT_SCANNER = "rtc360:6mm"
#: The robot's lidar of the method paper.
PAPER_SCANNER = "hdl-64e"
