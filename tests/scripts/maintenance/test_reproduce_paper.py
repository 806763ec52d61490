"""README and docs/paper.md say of Table I what the stored trials say."""

from drake_starnav.evaluation.suites import SUITES
from scripts.maintenance import reproduce_paper


def test_readme_and_page_are_up_to_date() -> None:
    assert reproduce_paper.main(["--check"]) == 0


def test_each_method_was_driven_in_the_same_first_trials() -> None:
    results = reproduce_paper.read_results(reproduce_paper.files(reproduce_paper.FOLDER))
    suite = SUITES["table1"]
    assert tuple(results.methods) == suite.methods and tuple(results.scenarios) == suite.scenarios
    trials = [[(record["trial"], record["seed"]) for record in case] for case in results.cases.values()]
    longest = max(trials, key=len)
    assert all(each == longest[: len(each)] and each for each in trials)
