#!/usr/bin/env python3
"""Times `edgeshade edt` against exact distance transforms on the CPU, in one run, and checks that all agree.

Needs: pip install numpy scipy opencv-python-headless edt diplib, and a release build of edgeshade.

    tools/edt_peers.py [--edgeshade target/release/edgeshade] [--rounds 5] [-o results] [--method auto]

Every round runs every library once on every mask, so that all see the same state of the machine; the figure is the median
over the rounds. Libraries get all threads, a mask of bytes in memory, and a warm-up; edgeshade's time is that of the GPU
timestamps from a mask of bytes in GPU memory to labels in GPU memory. With a radius the libraries do what they always do:
none of them can stop early.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

import cv2
import diplib
import edt
import numpy as np
from scipy import ndimage

SIZES = {"720p": (1280, 720), "1080p": (1920, 1080), "4K": (3840, 2160)}
SHAPES = {"few": 8, "many": 120}
RADII = [16, 32, 64, None]
NO_SEED = 0xFFFFFFFF


def silhouettes(width, height, shapes):
    """Both sides of the outlines of discs and polygons: the seeds that shadow edges give."""
    random = np.random.default_rng(5)
    scale = height / 720
    picture = np.zeros((height, width), np.uint8)
    for i in range(shapes):
        center = random.integers((width, height))
        radius = int(random.integers(10, 70) * scale)
        color = 255 if i % 4 < 2 else 0
        if i % 2:
            cv2.circle(picture, [int(c) for c in center], radius, color, -1)
        else:
            corners = (random.integers(-radius, radius, (6, 2)) + center).astype(np.int32)
            cv2.fillPoly(picture, [cv2.convexHull(corners)], color)
    seeds = np.zeros_like(picture)
    across, down = picture[:, :-1] ^ picture[:, 1:], picture[:-1] ^ picture[1:]
    seeds[:, :-1] |= across
    seeds[:, 1:] |= across
    seeds[:-1] |= down
    seeds[1:] |= down
    return np.where(seeds > 0, 255, 0).astype(np.uint8)


def timed(work):
    start = time.perf_counter()
    result = work()
    return result, 1e3 * (time.perf_counter() - start)


def opencv(away, _):
    return cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


def edtsq(away, threads):
    return edt.edtsq(away, black_border=False, parallel=threads)


def dip(away, threads):
    diplib.SetNumberOfThreads(threads)
    return np.asarray(diplib.EuclideanDistanceTransform(away > 0, border="object", method="separable"))


def scipy(away, _):
    return ndimage.distance_transform_edt(away, return_distances=False, return_indices=True)


def squared_root(distances, truth):
    # OpenCV and DIPlib return only roots, in single precision. A root counts as exact if it is as near to the true root as single
    # precision allows. No two integers below 2^22 share such a root.
    roots = np.sqrt(truth.astype(np.float64))
    near = np.abs(distances - roots) <= np.spacing(roots.astype(np.float32))
    return np.where(near, truth, np.rint(distances.astype(np.float64) ** 2)).astype(np.int64)


def squared_edtsq(values, _):
    return np.rint(values).astype(np.int64)


def squared_scipy(indices, _=None):
    y, x = np.indices(indices.shape[1:])
    return (indices[0].astype(np.int64) - y) ** 2 + (indices[1].astype(np.int64) - x) ** 2


LIBRARIES = {
    "opencv": (opencv, squared_root, f"OpenCV {cv2.__version__} DIST_MASK_PRECISE"),
    "edtsq": (edtsq, squared_edtsq, "edt.edtsq"),
    "diplib": (dip, squared_root, f"DIPlib {diplib.__version__} separable"),
    "scipy": (scipy, squared_scipy, "SciPy distance_transform_edt with indices"),
}


def squared_labels(labels, shape):
    """Squared distances from label bytes; -1 for none."""
    labels = np.frombuffer(labels, "<u4").reshape(shape)
    y, x = np.indices(shape)
    found = (labels & 0xFFFF).astype(np.int64), (labels >> 16).astype(np.int64)
    return np.where(labels == NO_SEED, -1, (found[0] - x) ** 2 + (found[1] - y) ** 2)


def edgeshade(program, mask, radius, method, frames, folder):
    labels = folder / "labels.u32"
    command = [program, "edt", mask, "--method", method, "--frames", str(frames), "--labels", labels, "--json", "-"]
    command += [] if radius is None else ["--radius", str(radius)]
    done = subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    return json.loads(done.stdout), labels.read_bytes()


def differing(squared, truth, radius):
    """Number of pixels whose squared distance differs from the truth. Beyond the radius the truth is -1."""
    expected = truth if radius is None else np.where(truth <= radius * radius, truth, -1)
    return int(np.count_nonzero(squared != expected))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edgeshade", type=pathlib.Path, default=pathlib.Path("target/release/edgeshade"))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--frames", type=int, default=5, help="transforms by edgeshade in each round")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--sizes", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("results"))
    args = parser.parse_args()
    if not args.edgeshade.is_file():
        sys.exit(f"{args.edgeshade} is not there: cargo build --release, or give --edgeshade")
    threads = cv2.getNumberOfCPUs()

    cases, device, wrong = [], None, 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for size in args.sizes:
            for shapes in SHAPES:
                seeds = silhouettes(*SIZES[size], SHAPES[shapes])
                away = np.where(seeds > 0, 0, 255).astype(np.uint8)
                mask = folder / f"{size}-{shapes}.png"
                cv2.imwrite(str(mask), seeds)
                times = {name: [] for name in LIBRARIES}
                ours = {radius: [] for radius in RADII}
                found, results, disagree = {}, {}, {}
                for _ in range(args.rounds + 1):
                    for name, (work, _, _) in LIBRARIES.items():
                        result, ms = timed(lambda: work(away, threads))
                        times[name].append(ms)
                        results.setdefault(name, result)
                    for radius in RADII:
                        figures, labels = edgeshade(args.edgeshade, mask, radius, args.method, args.frames, folder)
                        ours[radius].append(figures)
                        found.setdefault(radius, squared_labels(labels, seeds.shape))
                # The first round is the warm-up.
                truth = squared_scipy(results["scipy"])
                for name, (_, squared, _) in LIBRARIES.items():
                    disagree[name] = differing(squared(results[name], truth), truth, None)
                medians = {name: statistics.median(ms[1:]) for name, ms in times.items()}
                fastest = min((n for n in LIBRARIES if disagree[n] == 0), key=medians.get)
                for radius in RADII:
                    off = differing(found[radius], truth, radius)
                    wrong += off
                    figures = ours[radius][-1]
                    device = figures["device"]
                    ms = statistics.median(f["total_gpu_ms"] for f in ours[radius][1:])
                    passes = {}
                    for f in ours[radius][1:]:
                        for p in f["passes"]:
                            passes.setdefault(p["name"], []).append(p["gpu_ms"])
                    cases.append({
                        "size": size, "seeds": shapes, "seed_pixels": figures["seeds"], "radius": radius,
                        "method": figures["method"], "edgeshade_ms": ms,
                        "passes_ms": {name: statistics.median(v) for name, v in passes.items()},
                        "memory_bytes": figures["memory_bytes"], "labelled": figures["labelled"],
                        **{f"{name}_ms": medians[name] for name in LIBRARIES},
                        "fastest_exact": fastest, "ratio": ms / medians[fastest],
                        "pixels_off": off, **{f"{name}_pixels_off": disagree[name] for name in LIBRARIES},
                    })
                    print(row(cases[-1]), flush=True)
    text = report(cases, device, threads, args)
    slug = re.sub(r"[^a-z0-9]+", "-", device.lower()).strip("-")
    args.output.mkdir(exist_ok=True)
    (args.output / f"edt-{slug}.md").write_text(text)
    data = {"device": device, "threads": threads, "rounds": args.rounds, "frames": args.frames, "cases": cases}
    (args.output / f"edt-{slug}.json").write_text(json.dumps(data, indent=1) + "\n")
    print(text)
    if wrong:
        sys.exit(f"edgeshade is off in {wrong} pixels")


def row(case):
    radius = "none" if case["radius"] is None else case["radius"]
    cells = [case["size"], case["seeds"], radius, case["method"], f"{case['edgeshade_ms']:.2f}"]
    for name in LIBRARIES:
        off = case[f"{name}_pixels_off"]
        cells.append(f"{case[f'{name}_ms']:.1f}" + (f" (off in {off})" if off else ""))
    cells += [f"{case['ratio']:.2f}", case["pixels_off"]]
    return "| " + " | ".join(str(c) for c in cells) + " |"


def report(cases, device, threads, args):
    names = [description for _, _, description in LIBRARIES.values()]
    head = ["size", "seeds", "radius", "method", "edgeshade"] + list(LIBRARIES) + ["ratio", "pixels off"]
    lines = [
        f"# Exact distance transforms on {device}", "",
        f"Milliseconds, medians of {args.rounds} rounds with all taking turns, {threads} threads. edgeshade: GPU "
        "timestamps, from a byte mask in GPU memory to labels in GPU memory. "
        f"Peers: {'; '.join(names)}; they have no radius. ratio: edgeshade by the fastest peer that is exact. "
        "pixels off: whose squared distance differs from SciPy's. Written by `tools/edt_peers.py`.", "",
        "| " + " | ".join(head) + " |", "|" + "---|" * len(head),
    ]
    return "\n".join(lines + [row(c) for c in cases]) + "\n"


if __name__ == "__main__":
    main()
