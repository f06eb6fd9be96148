"""The JSON Schema that the command prints holds every scene that ships, and refuses what the command refuses.

    python tests/schema.py target/release/voxlathe
"""

import json
import pathlib
import subprocess
import sys
import tomllib

import jsonschema

schema = json.loads(subprocess.run([sys.argv[1], "generate", "schema"], check=True, capture_output=True).stdout)
validator = jsonschema.Draft202012Validator(schema)
scenes = sorted((pathlib.Path(__file__).parent.parent / "scenes").glob("*.toml"))
assert scenes
for path in scenes:
    scene = tomllib.loads(path.read_text())
    for error in validator.iter_errors(scene):
        sys.exit(f"{path.name}: {list(error.absolute_path)}: {error.message}")
scene["output"] = {"channels": ["occupancy", "fraction-1", "face-x", "profile-parameter"], "formats": ["exr", "zarr"]}
assert validator.is_valid(scene)
scene["output"] = {"channels": ["occupancy", "occupancy"]}
assert not validator.is_valid(scene)
print(f"{len(scenes)} scenes are as the schema has them")
