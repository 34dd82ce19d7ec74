from workbench.base.wording import in_mm, joint_list


def test_lengths_in_words():
    words = {0.0: "less than 0.001 mm", 1.7e-6: "0.0017 mm", 1.2345e-4: "0.123 mm", -2.5e-3: "-2.5 mm"}
    words |= {0.01234: "12.3 mm", 0.3456: "346 mm"}
    assert {metres: in_mm(metres) for metres in words} == words


def test_joints_in_a_row_are_a_range():
    words = {(2,): "joint 3", (1, 2): "joints 2, 3", tuple(range(6)): "joints 1–6"}
    words |= {(0, 1, 2, 4, 6): "joints 1–3, 5, 7", (4, 3): "joints 5, 4"}
    assert {joints: joint_list(joints) for joints in words} == words
