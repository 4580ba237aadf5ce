"""An abidw dump on standard input -> the exported functions and the types that they reach, on standard output.

abidw writes every type of every unit that exports something, thousands of them; callers see a handful.
"""

import sys
import xml.etree.ElementTree as xml

TYPE_IDS = ("type-id", "naming-typedef-id")


def mentioned(element):
    """Ids of the types that an element speaks of, in itself and below."""
    return {e.attrib[key] for e in element.iter() for key in TYPE_IDS if key in e.attrib}


def reachable(root):
    """Exported functions, and everything their types are made of."""
    definitions = {}
    for e in root.iter():
        if "id" in e.attrib:
            definitions.setdefault(e.attrib["id"], []).append(e)
    exported = [e for e in root.iter() if "elf-symbol-id" in e.attrib]
    seen, waiting = set(), set().union(*map(mentioned, exported))
    while waiting:
        name = waiting.pop()
        seen.add(name)
        waiting |= set().union(*map(mentioned, definitions.get(name, []))) - seen
    return seen


def prune(element, keep):
    """Leaves out what is no container, not exported and not reached."""
    for child in list(element):
        wanted = "elf-symbol-id" in child.attrib or child.attrib.get("id") in keep
        if child.tag in ("namespace-decl", "abi-instr"):
            prune(child, keep)
            wanted = len(child) > 0
        elif child.tag.startswith("elf-"):
            wanted = True
        if not wanted:
            element.remove(child)


def rename(element):
    """Calls that may unwind are the same calls to a linker: the type's name alone tells them apart."""
    for e in element.iter():
        if "name" in e.attrib:
            e.attrib["name"] = e.attrib["name"].replace('extern "C-unwind"', 'extern "C"')


corpus = xml.parse(sys.stdin).getroot()
rename(corpus)
prune(corpus, reachable(corpus))
xml.indent(corpus)
sys.stdout.write(xml.tostring(corpus, encoding="unicode") + "\n")
