"""Where a robot's links are: serial chains, from Denavit-Hartenberg tables and from URDF files."""

from robots.geometry.chain import Chain, Joint
from robots.geometry.dh import DhRow, chain_from_dh
from robots.geometry.urdf import UrdfTree, read_urdf

__all__ = ["Chain", "DhRow", "Joint", "UrdfTree", "chain_from_dh", "read_urdf"]
