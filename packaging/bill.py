#!/usr/bin/env python3
"""bill.py: the bill of materials of a build on Debian, as SPDX 2.3, on the standard output.

What sim is made of, and under which licences, is told by the tables of docs/licences.md; versions are
those of the installed packages. SOURCE_DATE_EPOCH is the moment that it names, or now.
"""
import datetime
import json
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def version_of_project():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"project\(sim VERSION ([\d.]+)", text)[1]


def libraries():
    """(name, Debian's package, licence, what it is linked into) of each row of the tables."""
    rows = re.findall(r"^\| ([^|]+) \| `([^`|]+)` \| ([^|]+) \| ([^|]+) \|$",
                      (ROOT / "docs/licences.md").read_text(), re.MULTILINE)
    return [tuple(cell.strip() for cell in row) for row in rows]


def installed_version(package):
    """None where it is not installed: its part of sim was not built."""
    query = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status} ${source:Version}",
                            package], capture_output=True, text=True)
    status, _, version = query.stdout.partition(" ")
    return version if query.returncode == 0 and status == "installed" else None


def package(name, version, licence, comment):
    return {"SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.]+", "-", name), "name": name,
            "versionInfo": version, "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "licenseConcluded": licence, "licenseDeclared": licence,
            "copyrightText": "NOASSERTION", "comment": comment}


def bill():
    version = version_of_project()
    moment = datetime.datetime.fromtimestamp(
        int(os.environ.get("SOURCE_DATE_EPOCH", datetime.datetime.now().timestamp())),
        datetime.timezone.utc)
    packages = [package("sim", version, "MIT", "all of the source")]
    for name, debian, licence, where in libraries():
        if (found := installed_version(debian)) is not None:
            packages.append(package(debian, found, licence, f"{name}: {where}"))
    root = packages[0]["SPDXID"]
    relations = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                  "relatedSpdxElement": root}]
    relations += [{"spdxElementId": root, "relationshipType": "DEPENDS_ON",
                   "relatedSpdxElement": each["SPDXID"]} for each in packages[1:]]
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"sim-{version}", "documentNamespace": f"https://sim.example/spdx/sim-{version}",
            "creationInfo": {"created": moment.strftime("%Y-%m-%dT%H:%M:%SZ"),
                             "creators": ["Tool: bill.py"]},
            "packages": packages, "relationships": relations}


if __name__ == "__main__":
    print(json.dumps(bill(), indent=1))
