"""List of parts of a release in the format CycloneDX 1.6: compiled files, their contents, and required packages."""

import hashlib
import importlib.metadata
import json
import uuid
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

TOOLS = ("fmpy", "scikit-build-core", "ziglang", "zopfli")


def sha256(path: Path) -> str:
    """Return the SHA-256 checksum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def parts(project: dict[str, Any], version: str, files: dict[str, Path], seconds: int) -> dict[str, Any]:
    """Return the list of parts of a release.

    If pip chooses the version of a package at installation, the list states no version, but a property "requirement".

    Parameters
    ----------
    project : dict
        The table [project] of pyproject.toml.
    version : str
        Version of the release.
    files : dict of str to Path
        Compiled files, by the names that they have in the list.
    seconds : int
        Time of the release (s since 1970).
    """
    own = f"pkg:pypi/{project['name']}@{version}"
    compiled = [
        {"type": "file", "bom-ref": name, "name": name, "hashes": [{"alg": "SHA-256", "content": sha256(path)}]}
        for name, path in sorted(files.items())
    ]
    headers = {
        "type": "library",
        "bom-ref": "fmi-headers",
        "name": "FMI headers",
        "description": "functions and types of FMI 2.0 and 3.0 as fmpy contains them, compiled into the FMU binaries",
        "licenses": [{"license": {"id": "BSD-2-Clause"}}],
        "purl": f"pkg:pypi/fmpy@{importlib.metadata.version('fmpy')}",
    }
    needed = [
        {
            "type": "library",
            "bom-ref": f"requirement-{k}",
            "name": Requirement(text).name,
            "purl": f"pkg:pypi/{Requirement(text).name.lower().replace('_', '-')}",
            "properties": [{"name": "requirement", "value": text}],
        }
        for k, text in enumerate(project["dependencies"], 1)
    ]
    components: list[dict[str, Any]] = [*compiled, headers, *needed]
    versions = [{"type": "application", "name": n, "version": importlib.metadata.version(n)} for n in TOOLS]
    found: dict[str, Any] = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "timestamp": datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "tools": {"components": versions},
            "component": {
                "type": "library",
                "bom-ref": own,
                "name": project["name"],
                "version": version,
                "description": project["description"],
                "licenses": [{"expression": project["license"]}],
                "purl": own,
            },
        },
        "components": components,
        "dependencies": [{"ref": own, "dependsOn": [c["bom-ref"] for c in components]}],
    }
    found["serialNumber"] = f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(found, sort_keys=True))}"
    return found
