//! The Euclidean distance transform: every method equals brute force, bit for bit.

use crate::common::with_gpu;
use ash::vk;
use edgeshade::gpu::{Buffer, Image, ImageDesc};
use edgeshade::host::Host;
use edgeshade::reference::distance_transform::edt::{Mask, nearest, nearest_fast, squared_distance};
use edgeshade::technique::distance_transform::{Bands, Edt, EdtConfig, EdtMethod, MAX_TILE_RADIUS, NO_SEED};
use edgeshade::{Frame, Handoff};

struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as u32
    }

    fn below(&mut self, n: usize) -> usize {
        self.next() as usize % n
    }

    /// Returns a mask with a fraction of the pixels as seeds, in millionths; at least one.
    fn sprinkle(&mut self, size: [usize; 2], millionths: u32) -> Mask {
        let n = size[0] * size[1];
        let mut seeds: Vec<bool> = (0..n).map(|_| self.next() % 1_000_000 < millionths).collect();
        seeds[self.below(n)] = true;
        Mask { size, seeds }
    }
}

fn mask(size: [usize; 2], is_seed: impl Fn(usize, usize) -> bool) -> Mask {
    let seeds = (0..size[0] * size[1]).map(|i| is_seed(i % size[0], i / size[0])).collect();
    Mask { size, seeds }
}

/// Returns the borders of a few discs and of a tilted half plane, which resemble shadow edges.
fn silhouettes(size: [usize; 2], random: &mut Random) -> Mask {
    let longest = size[0].max(size[1]);
    let discs: Vec<[f64; 3]> = (0..4)
        .map(|_| [random.below(size[0]), random.below(size[1]), 2 + random.below(1 + longest / 4)].map(|v| v as f64))
        .collect();
    let slope = random.below(200) as f64 / 100.0 - 1.0;
    let offset = random.below(size[1]) as f64;
    let inside = |x: f64, y: f64| {
        y > slope * x + offset || discs.iter().any(|[cx, cy, r]| (x - cx).powi(2) + (y - cy).powi(2) < r * r)
    };
    mask(size, |x, y| {
        let (x, y) = (x as f64, y as f64);
        inside(x, y) != inside(x + 1.0, y) || inside(x, y) != inside(x, y + 1.0)
    })
}

fn mask_image(host: &Host, mask: &Mask, format: vk::Format, seed: u8) -> Source {
    let texels: Vec<u8> = mask.seeds.iter().map(|&s| if s { seed } else { 0 }).collect();
    let usage = vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { usage, ..ImageDesc::storage("mask", format, mask.size.map(|n| n as u32)) };
    Source::Image(host.upload_image(&desc, &texels).unwrap())
}

/// Mask in one of the forms that a transform takes.
enum Source {
    Image(Image),
    /// Bytes, with the mask's size.
    Bytes(Buffer, [u32; 2]),
}

impl Source {
    /// Returns bytes whose padding would count as seeds if it were read.
    fn bytes(host: &Host, mask: &Mask) -> Self {
        let stride = mask.size[0].next_multiple_of(4);
        let mut bytes = vec![255u8; stride * mask.size[1]];
        for (i, seed) in mask.seeds.iter().enumerate() {
            bytes[i / mask.size[0] * stride + i % mask.size[0]] = if *seed { 1 << (i % 8) } else { 0 };
        }
        let buffer = host.upload("mask", vk::BufferUsageFlags::STORAGE_BUFFER, &bytes).unwrap();
        Self::Bytes(buffer, mask.size.map(|n| n as u32))
    }
}

fn record(host: &Host, edt: &mut Edt, source: &Source) -> edgeshade::Result<()> {
    host.run(|cmd| {
        // SAFETY: `cmd` is recording and is waited for.
        let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), None) };
        let recorded = match source {
            Source::Image(image) => edt.record(&mut frame, &image.as_ref()),
            Source::Bytes(buffer, _) => edt.record_bytes(&mut frame, buffer),
        };
        frame.end();
        recorded
    })
}

/// Returns labels and, if asked for, squared distances.
fn transform(host: &Host, source: &Source, config: EdtConfig) -> (Vec<u32>, Option<Vec<u32>>) {
    let extent = match source {
        Source::Image(image) => image.extent(),
        Source::Bytes(_, extent) => *extent,
    };
    let mut edt = Edt::new(host.context(), extent, config).unwrap();
    record(host, &mut edt, source).unwrap();
    (host.read_image(edt.labels()).unwrap(), edt.squared().map(|s| host.read_image(s).unwrap()))
}

/// Counts the pixels whose label differs, and those whose squared distance does; the latter matters more.
fn differing(width: usize, got: &[u32], expected: &[u32]) -> [usize; 2] {
    assert_eq!(got.len(), expected.len());
    let squared = |i, labels: &[u32]| squared_distance(width, i, labels[i]);
    let count = |differ: &dyn Fn(usize) -> bool| (0..got.len()).filter(|&i| differ(i)).count();
    [count(&|i| got[i] != expected[i]), count(&|i| squared(i, got) != squared(i, expected))]
}

/// Several band counts, so that bands are joined whatever the device would choose.
const BANDS: [Option<Bands>; 4] = [
    None,
    Some(Bands { rows: 3, columns: 2, pixels: 5 }),
    Some(Bands { rows: u32::MAX, columns: 7, pixels: 1 }),
    Some(Bands { rows: 2, columns: 64, pixels: u32::MAX }),
];

/// Numbers of comparisons, of pixels, and of pixels with a seed.
#[derive(Debug, Default)]
struct Tally {
    masks: usize,
    runs: usize,
    pixels: usize,
    labelled: usize,
}

impl Tally {
    /// Compares every method that supports this radius with the reference, on every pixel.
    fn compare(&mut self, host: &Host, mask: &Mask, radii: &[Option<u32>], what: &str) {
        let [width, height] = mask.size;
        let source = match self.masks % 2 {
            0 => mask_image(host, mask, vk::Format::R8_UNORM, 1 + (self.masks % 255) as u8),
            _ => Source::bytes(host, mask),
        };
        let is_small = width * height * mask.seeds.iter().filter(|s| **s).count() < 2_000_000;
        for &radius in radii {
            let expected = if is_small { nearest(mask, radius) } else { nearest_fast(mask, radius) };
            let tile = radius.is_some_and(|r| r <= MAX_TILE_RADIUS).then_some(EdtMethod::BoundedTile);
            for method in [EdtMethod::Pba, EdtMethod::BoundedRow].into_iter().chain(tile) {
                let squared = self.runs.is_multiple_of(3);
                let bands = BANDS[self.runs % BANDS.len()];
                let config = EdtConfig { method, radius, squared, bands };
                let (labels, distances) = transform(host, &source, config);
                let found = differing(width, &labels, &expected);
                assert_eq!(found, [0, 0], "{what}, {width}x{height}: {config:?}: labels, squared distances off");
                for (i, d) in distances.iter().flatten().enumerate() {
                    let right = squared_distance(width, i, expected[i]).unwrap_or(NO_SEED.into());
                    assert_eq!(u64::from(*d), right, "{what}, {width}x{height}: {config:?}: pixel {i}");
                }
                self.runs += 1;
                self.pixels += labels.len();
                self.labelled += labels.iter().filter(|l| **l != NO_SEED).count();
            }
        }
        self.masks += 1;
    }
}

const RADII: [u32; 9] = [1, 2, 7, 8, 31, 32, 33, 64, 90];

/// Returns no limit and two of the radii, which vary with `i`.
fn some_radii(i: usize) -> [Option<u32>; 3] {
    [None, Some(RADII[i % RADII.len()]), Some(RADII[(i * 3 + 5) % RADII.len()])]
}

#[test]
fn edt_hazards() {
    with_gpu(|host| {
        let mut tally = Tally::default();
        let all: Vec<Option<u32>> =
            [None, Some(0), Some(65), Some(200), Some(70_000)].into_iter().chain(RADII.map(Some)).collect();
        // No seed, all seeds, one in each corner, and each pair of corners, on sizes at which indices may go wrong.
        let sizes = [[1, 1], [1, 33], [33, 1], [7, 3], [32, 32], [31, 65], [64, 33], [70, 97]];
        for (i, size) in sizes.into_iter().enumerate() {
            let [right, bottom] = size.map(|n| n - 1);
            let radii = &all[..if i % 3 == 0 { all.len() } else { 4 }];
            tally.compare(host, &mask(size, |_, _| false), radii, "no seed");
            tally.compare(host, &mask(size, |_, _| true), radii, "all seeds");
            for corner in [[0, 0], [right, 0], [0, bottom], [right, bottom]] {
                let one = mask(size, |x, y| [x, y] == corner);
                tally.compare(host, &one, &some_radii(i + corner[0]), "one corner");
            }
            tally.compare(
                host,
                &mask(size, |x, y| [x, y] == [0, 0] || [x, y] == [right, bottom]),
                radii,
                "two corners",
            );
        }
        // Ties everywhere: lattices, diagonals, rows and columns.
        for (i, step) in [2, 3, 4, 6, 10, 16].into_iter().enumerate() {
            let size = [67 + 3 * step, 61 + step];
            tally.compare(host, &mask(size, |x, y| x % step == 0 && y % step == 0), &some_radii(i), "lattice");
            tally.compare(host, &mask(size, |x, y| (x + y) % step == 0), &some_radii(i + 1), "diagonals");
            tally.compare(
                host,
                &mask(size, |x, y| (x + y) % (2 * step) == 0 && x % 2 == 0),
                &some_radii(i + 2),
                "dotted",
            );
            tally.compare(host, &mask(size, |x, _| x % step == 1), &some_radii(i + 3), "columns");
            tally.compare(host, &mask(size, |_, y| y % step == 1), &some_radii(i + 4), "rows");
        }
        // Seeds inside a word or just beyond it: the borders of the blocks of 32 rows and columns.
        for (i, at) in [0, 30, 31, 32, 33, 63, 64, 65].into_iter().enumerate() {
            tally.compare(host, &mask([100, 100], |x, y| y == at && x % 9 == 0), &some_radii(i), "block row");
            tally.compare(host, &mask([100, 100], |x, y| x == at && y % 9 == 0), &some_radii(i), "block column");
        }
        println!("{tally:?}");
        assert!(tally.masks >= 100 && tally.labelled > 1_000_000 && tally.labelled < tally.pixels, "{tally:?}");
    });
}

#[test]
fn edt_of_random_masks() {
    with_gpu(|host| {
        let mut tally = Tally::default();
        let mut random = Random(3);
        let densities = [0, 100, 1000, 10_000, 50_000, 200_000, 500_000, 900_000, 999_000];
        for i in 0..90 {
            let size = [1 + random.below(150), 1 + random.below(150)];
            let made = match i % 3 {
                0 => silhouettes(size, &mut random),
                _ => random.sprinkle(size, densities[i % densities.len()]),
            };
            tally.compare(host, &made, &some_radii(i), &format!("random {i}"));
        }
        println!("{tally:?}");
        assert!(tally.masks >= 90 && tally.labelled * 3 > tally.pixels && tally.labelled < tally.pixels, "{tally:?}");
    });
}

#[test]
fn edt_of_large_masks() {
    with_gpu(|host| {
        let mut tally = Tally::default();
        let mut random = Random(4);
        let sizes = [
            [4099, 1],
            [1, 4099],
            [4099, 37],
            [37, 4099],
            [2053, 31],
            [31, 2053],
            [997, 211],
            [211, 997],
            [641, 359],
            [1031, 64],
            [64, 1031],
            [509, 503],
        ];
        for (i, size) in sizes.into_iter().enumerate() {
            for millionths in [0, 300, 100_000] {
                let made = random.sprinkle(size, millionths);
                let radii = [None, Some(RADII[(i + millionths as usize) % RADII.len()])];
                tally.compare(host, &made, &radii, &format!("large {millionths}"));
            }
            tally.compare(
                host,
                &silhouettes(size, &mut random),
                &[None, Some(RADII[i % RADII.len()])],
                "large outlines",
            );
        }
        // Many long, full rows: llvmpipe ends the loops of a thread after 65535 iterations in all.
        let dense = random.sprinkle([4099, 2053], 100_000);
        tally.compare(host, &dense, &[None, Some(64)], "many long rows");
        // The largest width that labels are tested for, with squares beyond 2^24; with all seeds, the envelope is
        // longest.
        let far = mask([16384, 3], |x, y| [x, y] == [0, 2] || [x, y] == [9000, 1] || [x, y] == [16383, 0]);
        tally.compare(host, &far, &[None, Some(5000)], "far");
        tally.compare(host, &mask([16384, 2], |_, _| true), &[None, Some(8)], "wide and full");
        // Seeds far apart, on both sides of tiles and of the segments that a workgroup of `bounded-row` walks along.
        let gaps =
            mask([16384, 70], |x, y| y == 20 && (x % 1999 == 5 || x == 8191 || x == 8200) || [x, y] == [8100, 69]);
        tally.compare(host, &gaps, &[Some(1), Some(8), Some(31), Some(64)], "gaps");
        let tall = mask([3, 16384], |x, y| [x, y] == [2, 0] || [x, y] == [1, 9000] || [x, y] == [0, 16383]);
        tally.compare(host, &tall, &[None, Some(5000)], "tall");
        println!("{tally:?}");
        assert!(tally.masks >= 50 && tally.labelled * 4 > tally.pixels, "{tally:?}");
    });
}

#[test]
fn edt_comparison_finds_a_planted_error() {
    with_gpu(|host| {
        let mask = mask([50, 40], |x, y| (x * 7 + y * 13) % 29 == 0);
        let image = mask_image(host, &mask, vk::Format::R8_UNORM, 255);
        let config = EdtConfig { radius: Some(9), ..EdtConfig::default() };
        let (labels, _) = transform(host, &image, config);
        assert_eq!(differing(50, &labels, &nearest(&mask, Some(9))), [0, 0]);
        // Another radius, one seed less and one moved label are all noticed.
        let seen = |labels: &[u32], expected: &[u32]| differing(50, labels, expected);
        assert!(seen(&labels, &nearest(&mask, Some(2)))[1] > 0);
        let mut less = mask.clone();
        let i = less.seeds.iter().rposition(|s| *s).unwrap();
        less.seeds[i] = false;
        assert!(seen(&labels, &nearest(&less, Some(9)))[1] > 0);
        let mut moved = labels.clone();
        moved[777] += 1;
        assert_eq!(seen(&moved, &labels), [1, 1]);
    });
}

#[test]
fn edt_masks_of_other_formats_and_seed_bits() {
    with_gpu(|host| {
        let made = Random(5).sprinkle([61, 70], 5000);
        let expected = nearest(&made, None);
        for format in [vk::Format::R8_UNORM, vk::Format::R8_UINT] {
            for seed in [1, 255] {
                let image = mask_image(host, &made, format, seed);
                assert_eq!(transform(host, &image, EdtConfig::default()).0, expected, "{format:?}, {seed}");
            }
        }
        // The pass packs the same words as the reference.
        let image = mask_image(host, &made, vk::Format::R8_UINT, 1);
        let mut edt = Edt::new(host.context(), [61, 70], EdtConfig::default()).unwrap();
        assert_eq!(edt.method(), if host.info().kind == "cpu" { EdtMethod::BoundedRow } else { EdtMethod::Pba });
        assert!(edt.memory_bytes() >= 4 * 61 * 70 + 4 * 61 * 3);
        assert_eq!(edt.seed_bits().size(), 4 * made.seed_bits().len() as u64);
        let wrong = mask_image(host, &mask([61, 71], |_, _| true), vk::Format::R8_UNORM, 1);
        let text = record(host, &mut edt, &wrong).unwrap_err().to_string();
        assert!(text.contains("61x71") && text.contains("61x70"), "{text}");
        // A second frame on the same object, after an error, has no trace of the first.
        record(host, &mut edt, &image).unwrap();
        record(host, &mut edt, &image).unwrap();
        assert_eq!(host.read_image::<u32>(edt.labels()).unwrap(), expected);
        let color = ImageDesc {
            usage: vk::ImageUsageFlags::SAMPLED,
            ..ImageDesc::storage("color", vk::Format::R8G8B8A8_UNORM, [61, 70])
        };
        let color = Source::Image(host.upload_image(&color, &vec![0; 4 * 61 * 70]).unwrap());
        let small = Source::bytes(host, &mask([61, 69], |_, _| true));
        let text = record(host, &mut edt, &small).unwrap_err().to_string();
        assert!(text.contains("4480"), "{text}");
        let text = record(host, &mut edt, &color).unwrap_err().to_string();
        assert!(text.contains("R8_UNORM"), "{text}");
    });
}

#[test]
fn edt_refuses_what_it_cannot_do() {
    with_gpu(|host| {
        let problem = |extent, config| match Edt::new(host.context(), extent, config) {
            Ok(_) => panic!("{extent:?}, {config:?} is accepted"),
            Err(e) => e.to_string(),
        };
        let plain = EdtConfig::default();
        for extent in [[0, 5], [5, 0], [65536, 1], [1, 65536]] {
            let text = problem(extent, plain);
            assert!(text.contains("1 to 65535"), "{text}");
        }
        for radius in [None, Some(65)] {
            let text = problem([9, 9], EdtConfig { method: EdtMethod::BoundedTile, radius, ..plain });
            assert!(text.contains("64") && text.contains("bounded-row"), "{text}");
        }
        let text = problem([65535, 20000], EdtConfig { squared: true, ..plain });
        assert!(text.contains("32 bits"), "{text}");
    });
}
