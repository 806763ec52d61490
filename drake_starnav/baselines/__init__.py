"""Controllers to compare with: each is one pure function of the robot's state and its surroundings."""

BASELINES = {
    "dsm": "drake_starnav.baselines.dsm_circles:DsmBaseline",
    "foa": "drake_starnav.baselines.foa:FoaBaseline",
    "foa_cluster": "drake_starnav.baselines.foa:make_clustering_foa",
    "foa_roadmap": "drake_starnav.baselines.foa:make_roadmap_foa",
    "dwa": "drake_starnav.baselines.dwa:DwaBaseline",
}
"""What a scenario may name as `controller.kind` beside `star`, and what makes the `Baseline`; it is imported late."""
