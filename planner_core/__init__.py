"""tlsplan's library: plan terrestrial laser scanning of a building, and prove how good the plan is.

Input is a scene file and the client's requirements; output is a plan folder. The library never prints and never exits:
progress goes through callbacks (`planner_core.progress`), faults through exceptions (`planner_core.errors`).
Open `planner_core.planning.plan` first: it shows the whole flow on one page.
"""
