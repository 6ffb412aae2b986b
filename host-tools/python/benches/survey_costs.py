"""What a survey of many recordings costs beside the diagnoses: prints the figures of host-tools/docs/survey.md.

    python host-tools/python/benches/survey_costs.py [RECORDINGS]

One recording is diagnosed once; its result is then copied, so that the survey finds everything done.
"""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

import bowden

RIG = Path(__file__).resolve().parents[2] / "core/tests/rigs/bench.toml"
BENCH = 100


def main(count: int) -> None:
    rig = bowden.Rig.load(RIG)
    with tempfile.TemporaryDirectory() as place:
        root = Path(place)
        typical = bowden.simulate(rig, seconds=40.0, rate_hz=1000.0)
        for ending in (".csv", ".csv.gz", ".mcap"):
            typical.save(root / f"typical{ending}")
            size = (root / f"typical{ending}").stat().st_size
            print(f"40 s at 1 kHz, {len(typical.channels)} channels, {ending}: {size / 1e6:.1f} MB")

        folder, out = root / "recordings", root / "out"
        (folder / "bench-0000").mkdir(parents=True)
        rig.save(folder / "rig.toml")
        first = folder / "bench-0000" / "run-000.csv"
        bowden.simulate(rig.with_values({"tendon.pretension_n": 24.0}), seconds=10.0, rate_hz=500.0).save(first)
        bowden.survey(folder, out=out, progress=False)
        kept = out / "diagnoses/bench-0000/run-000.csv.json"
        result = json.loads(kept.read_text())
        print(f"kept result: {kept.stat().st_size / 1e3:.1f} kB")
        for number in range(1, count):
            bench, name = f"bench-{number // BENCH:04}", f"run-{number % BENCH:03}.csv"
            for parent in (folder / bench, out / "diagnoses" / bench):
                parent.mkdir(exist_ok=True)
            os.link(first, folder / bench / name)
            result["recording"], result["bench"] = f"{bench}/{name}", bench
            (out / "diagnoses" / bench / f"{name}.json").write_text(json.dumps(result, separators=(",", ":")))

        before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        started = time.process_time()
        found = bowden.survey(folder, out=out, progress=False)
        assert (found.kept, found.diagnosed) == (count, 0)
        took_s = time.process_time() - started
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        tables = sum(path.stat().st_size for path in found.tables.values())
        print(f"{count} recordings of {first.stat().st_size / 1e6:.2f} MB that are done: {1e3 * took_s / count:.2f} ms of a processor each")
        print(f"memory: {peak_mb:.0f} MB, before it {before_mb:.0f} MB")
        print(f"tables: {tables / count:.0f} bytes a recording; page: {found.page.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000)
