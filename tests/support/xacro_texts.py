"""Descriptions of robots with macros, which test_xacro expands and compares with the package xacro."""

from __future__ import annotations

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
MACROS = """
<xacro:arg name="prefix" default="my_"/>
<xacro:arg name="links" default="3"/>
<xacro:property name="prefix" value="$(arg prefix)"/>
<xacro:property name="area" value="${pi * radius**2}"/>
<xacro:property name="radius" value="0.05"/>
<xacro:property name="lengths" value="${[0.3, 0.2, 0.1]}"/>
<xacro:property name="last" value="$(arg links)"/>
<xacro:property name="quoted" value="'it'"/>
<xacro:property name="limit_of_joints">
  <limit lower="${-pi/2}" upper="${radians(90)}" velocity="2" effort="50"/>
</xacro:property>
<xacro:macro name="inertial" params="mass r h *place">
  <inertial>
    <xacro:insert_block name="place"/>
    <mass value="${mass}"/>
    <inertia ixx="${mass*(3*r**2+h**2)/12}" ixy="0" ixz="0" iyy="${mass*(3*r**2+h**2)/12}" iyz="0" izz="${mass*r*r/2}"/>
  </inertial>
</xacro:macro>
<xacro:macro name="segment" params="number parent length:=0.3 axis:='0 0 1' density=1000 **extra">
  <link name="${prefix}link${number}">
    <xacro:inertial mass="${density * area * length}" r="${radius}" h="${length}">
      <origin xyz="0 0 ${length/2}" rpy="0 0 ${'0.1' if number % 2 else 0}"/>
    </xacro:inertial>
    <xacro:insert_block name="extra"/>
  </link>
  <joint name="${prefix}joint${number}" type="revolute">
    <parent link="${parent}"/>
    <child link="${prefix}link${number}"/>
    <origin xyz="0 0 ${length if number > 1 else 0.1}" rpy="${-1.5 + number} ${sin(0.25)} $(eval 2 * 0.125)"/>
    <axis xyz="${axis}"/>
    <xacro:insert_block name="limit_of_joints"/>
  </joint>
  <xacro:if value="${number &lt; last}">
    <xacro:segment number="${number + 1}" parent="${prefix}link${number}" length="${lengths[number]}" axis="0 1 0">
      <extra/>
    </xacro:segment>
  </xacro:if>
</xacro:macro>
"""
ROBOT = """
<link name="base"/>
<xacro:segment number="1" parent="base"><extra><visual name="${quoted}"/></extra></xacro:segment>
<xacro:unless value="${prefix != '' and not lengths[0] >= 1}"><link name="never"/></xacro:unless>
<xacro:if value="true"><link name="${prefix}flange"/></xacro:if>
<joint name="end" type="fixed">
  <parent link="${prefix}link$(arg links)"/><child link="${prefix}flange"/><origin xyz="0 0 ${max(lengths)}"/>
</joint>
"""
ARM = f"{HEAD}{MACROS}{ROBOT}</robot>"
