"""Handing a plan over: the plan folder, its USD stage, clouds, lists, maps and report."""
