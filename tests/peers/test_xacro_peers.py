"""Expanded descriptions of robots against the package xacro."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from algorithms.kinematics.xacro import expanded
from tests.support.xacro_texts import ARM, HEAD

pytestmark = pytest.mark.peers

MORE = f"""{HEAD}
<xacro:property name="a" value="${{2**3 // 3}}"/>
<xacro:property name="t" value="${{a == 2}}"/>
<xacro:property name="s" value="1e-3"/>
<xacro:macro name="pair" params="first second:=${{a*2}} third:='two words' *block">
  <p x="${{first}} ${{second}} ${{third}}"/><xacro:insert_block name="block"/>
</xacro:macro>
<xacro:pair first="${{s + a}}" third="${{'yes' if t else 'no'}}"><b y="${{[1, 2][0]}}"/></xacro:pair>
<xacro:pair first="0x"><b/></xacro:pair>
<xacro:unless value="${{t}}"><never/></xacro:unless>
</robot>"""


@pytest.mark.parametrize(("text", "arguments"), [(ARM, {}), (ARM, {"links": "2", "prefix": "l_"}), (MORE, {})])
def test_the_same_elements(text: str, arguments: dict[str, str]) -> None:
    xacro = pytest.importorskip("xacro")
    document = xacro.parse(text)
    xacro.process_doc(document, mappings=dict(arguments))
    theirs = ElementTree.fromstring(document.toxml())
    mine = expanded(ElementTree.fromstring(text), arguments, None, "text")
    one, other = ([(x.tag, x.attrib) for x in root.iter()] for root in (mine, theirs))
    assert one == other
