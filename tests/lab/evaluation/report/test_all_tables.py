"""Tables of suites that have a form of their own."""

import pytest
from lab.evaluation import joint_stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation.report.all_tables import suite_tables
from dloftbs_lab.evaluation.runner.run import evaluate


@pytest.mark.parametrize(
    ("function", "wrong", "right"), [(joint_stubs.cut_bars, 0.0, 50.0), (joint_stubs.sure_and_off, 66.7, 50.0)]
)
def test_real_footage_has_the_share_of_sure_curves_that_are_wrong(tmp_path, function, wrong, right):
    parts = evaluate([suite(Bars(length=1), name="real-footage")], [method(function)], tmp_path)
    (table,) = suite_tables(parts, "real-footage")
    row = dict(zip(table.columns, table.rows[0], strict=True))
    assert row["sure and wrong, %"] == pytest.approx(wrong, abs=0.1)
    assert row["right objects, %"] == pytest.approx(right)
