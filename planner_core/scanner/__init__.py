"""Scanners: their data sheets, modes, beams of a scan, range noise."""

#: What is planned with where nobody names a scanner: one that crews have; its usual mode has points 6 mm apart at 10 m.
DEFAULT_SCANNER = "rtc360"
#: The robot's lidar of the method paper.
PAPER_SCANNER = "hdl-64e"
