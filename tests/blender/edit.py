"""Takes a body through a real Blender, as somebody does who edits it there.

    edit.py IN.glb OUT.glb [EDIT]

EDIT is one of the functions below; without one the body is only imported and exported. The options of the export are
those that docs/how-to/blender.md asks for, less the one that a `without_…` leaves off. What an edit did is printed as JSON, so
that a test knows what to look for.
"""

import json
import os
import sys

import bpy

NEEDED = {"export_attributes": True, "use_mesh_vertices": True, "export_extras": True}


def layers():
    """The objects whose vertices are taxels."""
    return [o for o in bpy.data.objects if o.type == "MESH" and "_TAXEL_ID" in o.data.attributes]


def holding(taxel):
    """The object and vertex of the taxel with this id."""
    for o in layers():
        for vertex, value in enumerate(o.data.attributes["_TAXEL_ID"].data):
            if value.value == taxel:
                return o, vertex
    raise SystemExit(f"there is no taxel {taxel}")


def in_edit_mode(o, change):
    """Lets `change` work on the object's vertices, by the tools that the edit mode has."""
    import bmesh

    mesh = bmesh.new()
    mesh.from_mesh(o.data)
    mesh.verts.ensure_lookup_table()
    change(mesh, bmesh.ops)
    mesh.to_mesh(o.data)
    mesh.free()


def move(taxel):
    """Moves a taxel by 3 mm along its object's x."""
    o, vertex = holding(taxel)
    o.data.vertices[vertex].co.x += 0.003
    return {"moved": taxel}


def delete(taxel):
    """Deletes a taxel."""
    o, vertex = holding(taxel)
    in_edit_mode(o, lambda mesh, ops: ops.delete(mesh, geom=[mesh.verts[vertex]], context="VERTS"))
    return {"deleted": taxel}


def duplicate(taxel):
    """Duplicates a taxel and moves the copy by 3 mm along its object's x."""
    o, vertex = holding(taxel)

    def change(mesh, ops):
        copied = ops.duplicate(mesh, geom=[mesh.verts[vertex]])
        for copy in copied["geom"]:
            copy.co.x += 0.003

    in_edit_mode(o, change)
    return {"duplicated": taxel}


def add_field(taxel):
    """Adds an empty that is a field of one taxel and the next."""
    o, _ = holding(taxel)
    empty = bpy.data.objects.new("a new field", None)
    empty.parent = o.parent
    members = {str(taxel): [1], str(taxel + 1): [0.5]}
    empty["somatic_field"] = json.dumps({"version": 1, "name": "new", "members": members})
    bpy.context.scene.collection.objects.link(empty)
    return {"field": "new"}


def paint(taxel):
    """Paints a density on every mesh that is no taxels: x in its own coordinates, and a colour of the same."""
    painted = 0
    for o in bpy.data.objects:
        if o.type != "MESH" or "_TAXEL_ID" in o.data.attributes:
            continue
        density = o.data.attributes.new("_DENSITY", "FLOAT", "POINT")
        for vertex, value in zip(o.data.vertices, density.data):
            value.value = abs(vertex.co.x)
        painted += 1
    return {"painted": painted}


def main():
    source, target = sys.argv[1:3]
    edit = sys.argv[3] if len(sys.argv) > 3 else "nothing"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=source)
    options, did = dict(NEEDED), {}
    if edit.startswith("without_"):
        del options[edit.removeprefix("without_")]
    elif edit == "without":
        options = {}
    elif edit != "nothing":
        did = globals()[edit](int(sys.argv[4]))
    bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", **options)
    print("DID " + json.dumps(did), flush=True)
    # Blender 4.2 falls over its own feet when Python takes it down.
    os._exit(0)


main()
