"""Macros in descriptions of robots: what they expand to, and texts that are refused."""

from __future__ import annotations

from math import pi, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from algorithms.kinematics import DescriptionError, Robot
from algorithms.kinematics.urdf import described
from algorithms.kinematics.xacro import expanded
from tests.support.all_cases import all_cases
from tests.support.xacro_texts import ARM, HEAD, MACROS, ROBOT


def of(text: str, **arguments: Any) -> ElementTree.Element:
    """The expanded text of a robot."""
    return expanded(ElementTree.fromstring(f"{HEAD}{text}</robot>"), arguments, None, "text")


def only(text: str, **arguments: Any) -> str:
    """The attribute `x` of the last element."""
    return str(of(text, **arguments)[-1].get("x"))


def test_an_arm_of_segments() -> None:
    """Masses, places, axes and limits computed here from the same numbers."""
    arm = Robot.from_urdf(ARM)
    assert arm.joint_names == ("my_joint1", "my_joint2", "my_joint3") and arm.n_joints == 3
    lengths = np.array([0.3, 0.2, 0.1])
    assert np.allclose(arm.bodies[:, 0], 1000 * pi * 0.05**2 * lengths, rtol=1e-15)
    assert np.allclose(arm.limits[:, :2], [-pi / 2, pi / 2]) and (arm.limits[:, 2:] == [2, 50]).all()
    text = "".join(
        f'<link name="{k}"/><joint name="j{k}" type="continuous"><parent link="{k - 1}"/><child link="{k}"/>'
        f'<origin xyz="0 0 {z}" rpy="{k - 1.5} {sin(0.25)} 0.25"/><axis xyz="{axis}"/></joint>'
        for k, z, axis in ((1, 0.1, "0 0 1"), (2, 0.2, "0 1 0"), (3, 0.1, "0 1 0"))
    )
    end = '<joint name="e" type="fixed"><parent link="3"/><child link="4"/><origin xyz="0 0 0.3"/></joint>'
    same = Robot.from_urdf(f'<robot name="r"><link name="0"/><link name="4"/>{text}{end}</robot>', tip="4")
    q = np.array([0.3, -0.4, 0.9])
    assert np.allclose(arm.pose(q), same.pose(q), atol=1e-14)
    one = Robot.from_urdf(ARM, arguments={"links": 1, "prefix": "your_"})
    assert one.joint_names == ("your_joint1",) and "never" not in one.links


def test_included_files(tmp_path: Path) -> None:
    """Includes beside a file and in a package above it; a text has no folder."""
    inside = tmp_path / "arm_description" / "urdf"
    inside.mkdir(parents=True)
    (inside / "macros.xacro").write_text(f"{HEAD}{MACROS}</robot>")
    path = inside / "arm.urdf.xacro"
    same = Robot.from_urdf(ARM)
    for name in ("macros.xacro", "$(find arm_description)/urdf/macros.xacro", "$(dirname)/macros.xacro"):
        path.write_text(f'{HEAD}<xacro:include filename="{name}"/>{ROBOT}</robot>')
        found = Robot.from_urdf(path)
        assert np.array_equal(found.home, same.home) and np.array_equal(found.bodies, same.bodies)
    (tmp_path / "package.xml").write_text("<package><name> other_name </name></package>")
    path.write_text(
        f'{HEAD}<xacro:include filename="$(find other_name)/arm_description/urdf/macros.xacro"/>{ROBOT}</robot>'
    )
    assert np.array_equal(Robot.from_urdf(path).home, same.home)
    path.write_text(f'{HEAD}<xacro:include filename="arm.urdf.xacro"/></robot>')
    with pytest.raises(DescriptionError, match="nested"):
        Robot.from_urdf(path)
    with pytest.raises(FileNotFoundError):
        Robot.from_urdf(tmp_path / "none.xacro")
    with pytest.raises(DescriptionError, match="no folder"):
        of('<xacro:include filename="macros.xacro"/>')


def test_folders_of_blocks(tmp_path: Path) -> None:
    """A macro of another folder inside of a call does not change the folder of the call, nor what follows."""
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "other.xacro").write_text(
        f'{HEAD}<xacro:macro name="other" params=""><l x="$(dirname)"/></xacro:macro></robot>'
    )
    text = f"""{HEAD[:-1]} x="$(dirname)"><xacro:include filename="sub/other.xacro"/>
    <xacro:macro name="m" params="path **inside"><xacro:insert_block name="inside"/><l x="${{path}}"/></xacro:macro>
    <xacro:m path="$(dirname)/mesh"><b><xacro:other/></b></xacro:m></robot>"""
    found = expanded(ElementTree.fromstring(text), {}, tmp_path, "text")
    assert [each.get("x") for each in (found, *found)] == [str(tmp_path), f"{tmp_path}/sub", f"{tmp_path}/mesh"]


@all_cases(
    "name",
    ['"$(eval 1+2)"/>', '"3"><l>${1+2}</l></link>', '"${1+2}"/>'],
)
def test_expressions_without_elements_of_xacro(name: str) -> None:
    """Each is enough for a description to be expanded."""
    root, _ = described(f"<robot><link name={name}</robot>", {})
    assert root[0].get("name") == "3" and all(each.text == "3" for each in root[0])


def test_unknown_arguments() -> None:
    """Arguments that no file declares are refused, also where there is nothing to expand."""
    with pytest.raises(DescriptionError, match="no argument 'link'; expected some of links, prefix"):
        Robot.from_urdf(ARM, arguments={"link": 1})
    with pytest.raises(DescriptionError, match="no argument 'link'; expected some of none"):
        described("<robot/>", {"link": 1})
    assert described('<robot><link name="$(arg link)"/></robot>', {"link": 1})[0][0].get("name") == "1"


def test_macros_in_conditions_count_once() -> None:
    """A macro may call itself 90 times inside of conditions, since only macros and includes are counted."""
    text = """<xacro:macro name="m" params="k"><l x="${k}"/><xacro:if value="${k &lt; 90}"><xacro:m k="${k + 1}"/>
    </xacro:if></xacro:macro><xacro:m k="1"/>"""
    assert [each.get("x") for each in of(text)] == [str(k + 1) for k in range(90)]


P = '<xacro:property name="a" value="{0}"/>'


@all_cases(
    "text, value",
    [
        (P.format("2") + '<l x="${a + 1}"/>', "3"),
        (P.format("2.5") + '<l x="${a}m ${2*a}"/>', "2.5m 5.0"),
        (P.format("${b}") + '<xacro:property name="b" value="7"/><l x="${a*2}"/>', "14"),
        (P.format("true") + '<l x="${\'yes\' if a else \'no\'}"/>', "yes"),
        (P.format("'3'") + "<l x=\"${a + '4'}\"/>", "34"),
        (P.format("1") + '<xacro:property name="a" default="2"/><l x="${a}"/>', "1"),
        (P.format("3") + '<l x="${-a}"/>', "-3"),
        ('<l x="${[4, 5, 6][1] // 2}"/>', "2"),
        ('<l x="${1 &lt; 2 &lt;= 2 and not 3 in [1, 2]}"/>', "True"),
        ('<l x="${round(math.cos(pi), 3)}"/>', "-1.0"),
        ('<l x="$${a} $$(b)"/>', "${a} $(b)"),
        ('<l x="${0 or 5}${1 and 3}"/>', "53"),
        (
            P.format("1") + '<xacro:macro name="m" params="a:=^|5"><l x="${a}"/></xacro:macro><xacro:m/>', "1",
        ),
        ('<xacro:macro name="m" params="a:=^|5"><l x="${a}"/></xacro:macro><xacro:m/>', "5"),
        (
            '<xacro:macro name="m" params="a"><xacro:property name="b" value="${a}" scope="parent"/></xacro:macro>'
            '<xacro:m a="8"/><l x="${b}"/>', "8",
        ),
        ('<xacro:macro name="m" params=""><l x="1"/></xacro:macro><xacro:call macro="m"/>', "1"),
        ('<xacro:arg name="n" default="4"/><l x="$(arg n)"/>', "4"),
        (
            '<xacro:arg name="n" default="4"/><xacro:macro name="m" params="grid:=$(arg n) a := 3"><l x="${grid}${a}"/>'
            "</xacro:macro><xacro:m/>", "43",
        ),
        (
            P.format("1") + '<xacro:property name="a" remove="true"/><xacro:property name="a" default="2"/>'
            '<l x="${a}"/>', "2",
        ),
        (
            P.format("1") + '<xacro:property name="b" value="${a}" lazy_eval="false"/>' + P.format("2")
            + '<l x="${b}"/>', "1",
        ),
        ('<l x="$$${1}"/>', "$${1}"),
    ],
)  # fmt: skip
def test_values(text: str, value: str) -> None:
    assert only(text) == value


def test_scopes() -> None:
    """Properties of a macro are not those of its caller."""
    text = (
        P.format("1")
        + f'<xacro:macro name="m" params="">{P.format(2)}<l x="${{a}}"/></xacro:macro><xacro:m/><l x="${{a}}"/>'
    )
    assert [each.get("x") for each in of(text)] == ["2", "1"]


M = '<xacro:macro name="m" params="a *b"><l x="${a}"/></xacro:macro>'
DOUBLED = "".join(f'<xacro:property name="a{k + 1}" value="${{a{k} + a{k}}}"/>' for k in range(60))


@all_cases(
    "text, message",
    [
        ('<l x="${b}"/>', "no property 'b'"),
        (P.format("${a}") + '<l x="${a}"/>', "refers to itself"),
        ('<l x="${1 +}"/>', "no expression"),
        ('<l x="${1/0}"/>', "division by zero"),
        ('<l x="${1"/>', "does not end"),
        ("<xacro:m/>", "no such macro"),
        ('<l x="$(arg n"/>', "does not end"),
        ('<xacro:macro name="m" params="id grid:=3"/><xacro:m/>', "no id; expected"),
        ('<xacro:macro name="m" params="prefix parent_prefix:=x"/><xacro:m/>', "no prefix; expected"),
        ('<xacro:macro name="m" params="a, b"/>', "'a,' in params="),
        (M + '<xacro:m a="1"><o/><surplus/></xacro:m>', "<surplus> is an element more"),
        (P.format("1") + '<xacro:property name="a" remove="true"/><l x="${a}"/>', "no property 'a'"),
        (P.format("1") + '<xacro:property name="a" value="2" remove="true"/>', "remove and a value"),
        (f"{'<l>' * 900}{'</l>' * 900}", "nested too often"),
        ('<l x="${round(5, -10000000)}"/>', "at most 4096"),
        (f'<xacro:property name="a" value="${{[{"1," * 3000}]}}"/><l x="${{len(str([{"a," * 100}]))}}"/>', "more than"),
        (M + "<xacro:m/>", "no a; expected"),
        (M + '<xacro:m a="1"/>', r"no element for \*b"),
        (M + '<xacro:m a="1" c="2"><o/></xacro:m>', "c is no parameter"),
        ('<xacro:macro name="m" params=""><xacro:m/></xacro:macro><xacro:m/>', "nested"),
        ('<xacro:if value="perhaps"/>', "expected true, false"),
        ('<xacro:arg name="n"/>', "no argument 'n'"),
        ('<l x="$(arg n)"/>', "no argument 'n'"),
        ('<l x="$(env HOME)"/>', "expected arg, eval"),
        ('<l x="$(find ur)"/>', "no folder or package.xml"),
        ('<xacro:insert_block name="b"/>', "insert_block of 'b'"),
        ('<l x="${__import__(\'os\')}"/>', "no property '__import__'"),
        ('<l x="${().__class__}"/>', "not supported"),
        ('<l x="${str.mro()}"/>', "not supported"),
        ('<l x="${[x for x in [1]]}"/>', "not supported"),
        ('<l x="${(lambda: 1)()}"/>', "not supported"),
        ('<l x="${9**9**9}"/>', "too long"),
        ("<l x=\"${'a' * 1000000000}\"/>", "expected numbers"),
        ('<xacro:property name="a0" value="abc"/>' + DOUBLED + '<l x="${a60}"/>', "more than"),
        ('<xacro:property name="a0" value="${[1]}"/>' + DOUBLED + '<l x="${a60}"/>', "more than"),
        ('<xacro:macro name="m" params="k"><xacro:if value="${k > 0}"><xacro:m k="${k - 1}"/><xacro:m k="${k - 1}"/>'
         '</xacro:if></xacro:macro><xacro:m k="200"/>', "nested"),
    ],
)  # fmt: skip
def test_errors(text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        of(text)
