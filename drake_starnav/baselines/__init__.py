"""Controllers to compare with: each is one pure function of the robot's state and its surroundings.

`BASELINES` has whatever a scenario may name as `controller.kind` beside `star`. Only their names stand once more, in
`scenario.shipped.METHODS`, which help texts show before anything is imported.
"""

from collections.abc import Mapping

from drake_starnav.baselines.baseline_step import Baseline
from drake_starnav.baselines.dsm_circles import DsmBaseline
from drake_starnav.baselines.dwa import DwaBaseline
from drake_starnav.baselines.foa import FoaBaseline

BASELINES: Mapping[str, Baseline] = {
    "dsm": DsmBaseline(),
    "foa": FoaBaseline(),
    "foa_cluster": FoaBaseline(clusters=True),
    "foa_roadmap": FoaBaseline(follows_roadmap=True),
    "dwa": DwaBaseline(),
}
"""By name."""
