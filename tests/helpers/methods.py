"""Methods of a user's own, named as `tests.helpers.methods:ahead`."""

from pydrake.systems.framework import LeafSystem

from drake_starnav import Parts, Scenario, Unshielded

NOT_A_FUNCTION = 3


class Ahead(LeafSystem):
    """Drives straight on."""

    def __init__(self) -> None:
        """Its only port is `desired_twist`."""
        super().__init__()
        self.DeclareVectorOutputPort("desired_twist", 2, lambda context, output: output.SetFromVector([0.6, 0.0]))


def ahead(scenario: Scenario) -> LeafSystem:
    """The controller alone, behind the scenario's shield."""
    return Ahead()


def blind(scenario: Scenario) -> Parts:
    """The controller without a shield."""
    return Parts(controller=Ahead(), shield=Unshielded(scenario.robot, scenario.controller))


def nothing(scenario: Scenario) -> None:
    """No parts."""
