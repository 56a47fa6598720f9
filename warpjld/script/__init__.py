"""The command language of scripts: parser, registry of commands, interpreter and scene (A §9, R79–R88)."""

from warpjld.script.arguments import Arguments
from warpjld.script.interpreter import Interpreter
from warpjld.script.outputs import CameraSetting
from warpjld.script.parser import parse, parse_file
from warpjld.script.registry import Command, Registry, all_commands, command, commands_table
from warpjld.script.scene import Actor, Scene

__all__ = [
    "Actor",
    "Arguments",
    "CameraSetting",
    "Command",
    "Interpreter",
    "Registry",
    "Scene",
    "all_commands",
    "command",
    "commands_table",
    "parse",
    "parse_file",
]
