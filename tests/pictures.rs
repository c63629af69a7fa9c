//! Picture files and contact sheets, read back by independent code, and input that must be rejected.
#![cfg(feature = "app")]

use std::{fs, path::Path};

use edgeshade::picture::{
    NOT_JUDGED, Picture, false_color, read_exr, read_png_gray, read_visibility,
    sheet::{Header, MAX_ROWS, Options, Row, choose_closeups, compose},
    write_atomic, write_exr, write_png, write_png_gray,
};
use tempfile::tempdir;

/// A picture with some content: a dark disc on a light gradient.
fn disc(size: [u32; 2], centre: [f32; 2], radius: f32) -> (Picture, Vec<f32>) {
    let visibility: Vec<f32> = (0..size[0] * size[1])
        .map(|i| {
            let (x, y) = ((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5);
            if (x - centre[0]).hypot(y - centre[1]) < radius { 0.0 } else { 1.0 }
        })
        .collect();
    (Picture::from_visibility(&visibility, size).unwrap(), visibility)
}

fn names(folder: &Path) -> Vec<String> {
    let mut n: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    n.sort();
    n
}

#[test]
fn a_png_is_what_another_reader_reads() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("a.png");
    let rgb: Vec<[u8; 3]> = (0..35u8).map(|i| [i, 7 * i, 255 - i]).collect();
    write_png(&path, &Picture { size: [7, 5], rgb: rgb.clone() }).unwrap();
    let read = image::open(&path).unwrap().into_rgb8();
    assert_eq!(read.dimensions(), (7, 5));
    assert!(read.pixels().zip(&rgb).all(|(a, b)| a.0 == *b));
    let red = read_png_gray(&path, [7, 5]).unwrap();
    assert!(red.iter().zip(&rgb).all(|(v, c)| *v == f32::from(c[0]) / 255.0));
    assert_eq!(names(folder.path()), ["a.png"], "no temporary file stays");
}

#[test]
fn visibility_survives_png_and_exr() {
    let folder = tempdir().unwrap();
    let size = [13, 9];
    let v: Vec<f32> = (0..117).map(|i| i as f32 / 116.0).collect();
    let png = folder.path().join("v.png");
    write_png_gray(&png, size, &v).unwrap();
    let read = read_visibility(&png, size).unwrap();
    assert!(read.iter().zip(&v).all(|(a, b)| (a - b).abs() <= 1.0 / 131_000.0));
    assert_eq!((read[0], read[116]), (0.0, 1.0));

    let other: Vec<f32> = v.iter().map(|x| 1e20 * x - 3.0).collect();
    for channels in [vec![("R", v.as_slice()), ("depth", &other)], vec![("V", &v), ("A", &other)], vec![("x", &v)]] {
        let exr = folder.path().join("v.exr");
        write_exr(&exr, size, &channels).unwrap();
        assert_eq!(read_visibility(&exr, size).unwrap(), v, "bit for bit");
        for (name, plane) in &channels {
            assert_eq!(read_exr(&exr, size, Some(name)).unwrap(), *plane);
        }
    }
    // The `exr` crate's own reader is independent of this crate's code.
    let exr = folder.path().join("v.exr");
    write_exr(&exr, size, &[("R", &v), ("G", &other), ("B", &v)]).unwrap();
    let image = exr::prelude::read_first_flat_layer_from_file(&exr).unwrap();
    let list = &image.layer_data.channel_data.list;
    assert_eq!(list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>(), ["B", "G", "R"]);
    assert_eq!(list[1].sample_data.values_as_f32().collect::<Vec<_>>(), other);
}

#[test]
fn wrong_files_are_refused_by_name_and_reason() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let v = vec![0.5f32; 12];
    write_png_gray(&at("v.png"), [4, 3], &v).unwrap();
    write_exr(&at("v.exr"), [4, 3], &[("a", &v), ("b", &v)]).unwrap();
    write_exr(&at("nan.exr"), [4, 3], &[("R", &[0.0, 1.0, 0.5, 0.0, 0.0, f32::NAN, 0., 0., 0., 0., 0., 0.])]).unwrap();
    write_exr(&at("big.exr"), [2, 1], &[("R", &[0.0, 1.5])]).unwrap();
    fs::write(at("text.png"), "hello").unwrap();
    let whole = fs::read(at("v.png")).unwrap();
    fs::write(at("cut.png"), &whole[..whole.len() / 2]).unwrap();
    let whole = fs::read(at("nan.exr")).unwrap();
    fs::write(at("cut.exr"), &whole[..whole.len() - 9]).unwrap();
    for (name, size, reasons) in [
        ("v.png", [3, 4], vec!["4x3", "3x4"]),
        ("nan.exr", [40, 30], vec!["4x3", "40x30"]),
        ("v.exr", [4, 3], vec!["R, V, Y", "a, b"]),
        ("nan.exr", [4, 3], vec!["(1, 1)", "NaN"]),
        ("big.exr", [2, 1], vec!["(1, 0)", "1.5"]),
        ("text.png", [4, 3], vec!["neither PNG nor OpenEXR"]),
        ("cut.png", [4, 3], vec!["PNG"]),
        ("cut.exr", [4, 3], vec!["OpenEXR"]),
        ("missing.png", [4, 3], vec!["o such file"]),
    ] {
        let text = read_visibility(&at(name), size).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
        assert!(reasons.iter().all(|r| text.contains(r)), "{name}: {text}");
    }
    assert!(read_exr(&at("v.exr"), [4, 3], Some("c")).unwrap_err().to_string().contains("no channel c"));
    assert_eq!(read_exr(&at("v.exr"), [4, 3], Some("b")).unwrap(), v);
}

#[test]
fn a_header_that_lies_about_the_size_takes_no_memory() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("bomb.png");
    write_png_gray(&path, [4, 3], &[0.5; 12]).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    bytes[16..24].copy_from_slice(&[0x00, 0x0f, 0xff, 0xff, 0x00, 0x0f, 0xff, 0xff]);
    // The chunk's checksum must be right, or the file would be rejected because of it.
    let mut crc = u32::MAX;
    for byte in &bytes[12..29] {
        crc ^= u32::from(*byte);
        (0..8).for_each(|_| crc = (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 });
    }
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    fs::write(&path, &bytes).unwrap();
    let text = read_visibility(&path, [4, 3]).unwrap_err().to_string();
    assert!(text.contains("bomb.png") && text.contains("1048575x1048575 px"), "{text}");
}

#[test]
fn damaged_files_never_panic() {
    let folder = tempdir().unwrap();
    let size = [9, 6];
    let v: Vec<f32> = (0..54).map(|i| (i % 7) as f32 / 7.0).collect();
    let path = folder.path().join("x");
    write_png_gray(&path, size, &v).unwrap();
    let png = fs::read(&path).unwrap();
    write_exr(&path, size, &[("R", &v), ("G", &v)]).unwrap();
    let exr = fs::read(&path).unwrap();
    let mut state = 5u64;
    for whole in [png, exr] {
        for round in 0..600usize {
            let mut bytes = whole.clone();
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (state >> 33) as usize % bytes.len();
            bytes[at] ^= 1 << (round % 8);
            if round % 5 == 0 {
                bytes.truncate(at);
            }
            fs::write(&path, &bytes).unwrap();
            let _ = read_visibility(&path, size);
        }
    }
}

#[test]
fn what_cannot_be_written_is_an_error_and_leaves_the_old_file() {
    let folder = tempdir().unwrap();
    let picture = Picture::filled([2, 2], [1, 2, 3]);
    let missing = folder.path().join("no/such/a.png");
    let text = write_png(&missing, &picture).unwrap_err().to_string();
    assert!(text.contains("no/such/a.png") && text.contains("does not exist"), "{text}");
    assert!(!folder.path().join("no").exists());
    assert!(write_png(folder.path(), &picture).unwrap_err().to_string().contains("folder"));

    let path = folder.path().join("a.png");
    write_png(&path, &picture).unwrap();
    let before = fs::read(&path).unwrap();
    let broken = Picture { size: [3, 3], rgb: vec![[0; 3]; 8] };
    assert!(write_png(&path, &broken).unwrap_err().to_string().contains("8 values"));
    assert!(write_png(&path, &Picture::filled([0, 4], [0; 3])).is_err());
    assert!(write_exr(&path, [2, 2], &[]).is_err());
    assert!(write_exr(&path, [2, 2], &[("R", &[0.0; 3])]).is_err());
    assert!(write_exr(&path, [1, 1], &[("R", &[0.0]), ("R", &[0.0])]).is_err());
    assert!(write_exr(&path, [1, 1], &[("", &[0.0])]).is_err());
    assert_eq!(fs::read(&path).unwrap(), before);
    write_atomic(&path, b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(names(folder.path()), ["a.png"]);
}

#[cfg(unix)]
#[test]
fn links_and_devices_stay_what_they_are() {
    let folder = tempdir().unwrap();
    let (real, link) = (folder.path().join("real"), folder.path().join("link"));
    fs::write(&real, b"old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    write_atomic(&link, b"new").unwrap();
    assert!(link.is_symlink());
    assert_eq!(fs::read(&real).unwrap(), b"new");
    let null = folder.path().join("null");
    std::os::unix::fs::symlink("/dev/null", &null).unwrap();
    write_atomic(&null, b"gone").unwrap();
    assert!(!fs::metadata(&null).unwrap().is_file());
}

#[test]
fn error_pictures_show_sign_and_mask() {
    let p = Picture::from_error(&[0.0, 1.0, 0.5, 0.0], &[1.0, 0.0, 0.5, 1.0], &[true, true, true, false], [2, 2]);
    assert_eq!(p.unwrap().rgb, [false_color(-1.0), false_color(1.0), false_color(0.0), NOT_JUDGED]);
    assert!(Picture::from_error(&[0.0], &[1.0], &[], [1, 1]).unwrap_err().to_string().contains("mask"));
    assert!(Picture::from_visibility(&[0.0; 3], [2, 2]).is_err());
}

fn sheet(size: [u32; 2], count: usize, options: &Options) -> Picture {
    let (truth, v) = disc(size, [0.6 * size[0] as f32, 0.4 * size[1] as f32], 0.2 * size[0] as f32);
    let made: Vec<(String, Picture, Picture)> = (1..count)
        .map(|k| {
            let (full, t) = disc(size, [0.62 * size[0] as f32, 0.4 * size[1] as f32], 0.2 * size[0] as f32);
            let error = Picture::from_error(&t, &v, &vec![true; v.len()], size).unwrap();
            (format!("technique {k} {}", "with a name ".repeat(k)), full, error)
        })
        .collect();
    let mut rows = vec![Row { label: "truth", caption: "", full: &truth, error: None }];
    let caption =
        "RMSE 0.1234  SSIM 0.9876\n1.23 ms, 8 MiB and a line that is far too long for its column, so it wraps";
    rows.extend(made.iter().map(|(label, full, error)| Row { label, caption, full, error: Some(error) }));
    let header = Header { title: "A scene", note: "size, light" };
    compose(&header, &rows, options).unwrap()
}

#[test]
fn sheets_are_made_of_one_to_twenty_techniques_and_of_tiny_pictures() {
    for count in [1, 2, 5, 6, 7, 13, 20] {
        let s = sheet([160, 90], count, &Options::default());
        assert_eq!(s.rgb.len(), (s.size[0] * s.size[1]) as usize);
        assert!(s.size[0] <= 2700, "{:?}", s.size);
        // Nothing is cut off: the margins hold only the background.
        let [w, h] = s.size.map(|v| v as usize);
        let background = s.rgb[0];
        let margin = |i: usize| i % w < 20 || i % w >= w - 20 || i / w < 20 || i / w >= h - 20;
        assert!((0..w * h).filter(|&i| margin(i)).all(|i| s.rgb[i] == background), "{count}");
        // Each cell has the frames of both close-ups, around the picture and around the detail.
        let orange = s.rgb.iter().filter(|c| **c == [255, 178, 28]).count();
        assert!(orange > 1000 * count, "{count}: {orange}");
    }
    let wide = |n| sheet([160, 90], n, &Options::default()).size[0];
    assert!(wide(20) == wide(5) && wide(7) == wide(4) && wide(6) > wide(5));
    for size in [[1, 1], [1, 7], [7, 1], [47, 48], [49, 48], [3000, 2], [2, 3000], [97, 101]] {
        for count in [1, 3] {
            sheet(size, count, &Options::default());
        }
    }
    for (closeup_px, zoom) in [(1, 1), (256, 1), (3, 16), (300 - 44, 3)] {
        sheet([120, 300], 3, &Options { closeup_px, zoom, ..Options::default() });
    }
    assert_eq!(sheet([160, 90], 5, &Options::default()), sheet([160, 90], 5, &Options::default()));
}

#[test]
fn a_sheet_shows_the_pictures_themselves() {
    // A close-up in the sheet is a part of the picture, four times as large. The test finds it by its frame.
    let size = [400, 225];
    let (truth, _) = disc(size, [200.0, 100.0], 60.0);
    let rows = [Row { label: "truth", caption: "", full: &truth, error: None }];
    let closeup = [130, 70, 48, 48];
    let options = Options { closeups: Some(vec![closeup]), ..Options::default() };
    let s = compose(&Header::default(), &rows, &options).unwrap();
    let found = (0..s.rgb.len()).any(|corner| {
        let width = s.size[0] as usize;
        let at = |x: usize, y: usize| s.rgb.get(corner + y * width + x).copied();
        corner >= 1
            && s.rgb[corner - 1] == [255, 178, 28]
            && (0..192 * 192).all(|i| {
                let (x, y) = (i % 192, i / 192);
                let from = (70 + y / 4) * 400 + 130 + x / 4;
                at(x, y) == Some(truth.rgb[from])
            })
    });
    assert!(found);
}

#[test]
fn closeups_find_what_differs() {
    let size = [640, 360];
    let (truth, _) = disc(size, [150.0, 180.0], 80.0);
    // The two pictures differ in a small square far from the disc and in an even smaller one elsewhere.
    let mut other = truth.clone();
    for (left, top, side) in [(500, 60, 30), (420, 300, 20)] {
        for i in 0..side * side {
            other.rgb[(top + i / side) * 640 + left + i % side] = [0; 3];
        }
    }
    let row = |full| Row { label: "", caption: "", full, error: None };
    let holds = |c: &[u32; 4], p: [u32; 2]| (0..2).all(|k| c[k] <= p[k] && p[k] < c[k] + c[k + 2]);
    let found = choose_closeups(&[row(&truth), row(&other)], 48);
    assert_eq!(found.len(), 2);
    assert!(holds(&found[0], [515, 75]), "{found:?}");
    assert!(holds(&found[1], [430, 310]), "{found:?}");
    // Without differences the detail shows the edge of the disc. Without any content there are still two details that
    // do not overlap.
    for picture in [&truth, &Picture::filled(size, [9; 3])] {
        let found = choose_closeups(&[row(picture)], 48);
        assert_eq!(found.len(), 2);
        assert!((0..2).any(|k| found[0][k].abs_diff(found[1][k]) >= 48), "{found:?}");
        for c in found {
            assert!(c[0] + c[2] <= size[0] && c[1] + c[3] <= size[1]);
            let (x, y) = (c[0] as f32 + 24.0, c[1] as f32 + 24.0);
            assert!(picture != &truth || ((x - 150.0).hypot(y - 180.0) - 80.0).abs() < 24.0, "{c:?}");
        }
    }
}

#[test]
fn sheets_refuse_what_they_cannot_show() {
    let (small, large) = (Picture::filled([4, 4], [0; 3]), Picture::filled([5, 4], [0; 3]));
    let (empty, broken) = (Picture::filled([0, 3], [0; 3]), Picture { size: [2, 2], rgb: vec![] });
    let row = |full| Row { label: "name", caption: "", full, error: None };
    let refused = |rows: &[Row], options: &Options| compose(&Header::default(), rows, options).unwrap_err().to_string();
    let usual = Options::default();
    assert!(refused(&[], &usual).contains("no pictures"));
    assert!(refused(&[row(&small), row(&large)], &usual).contains("name is 5x4 px"));
    assert!(refused(&[Row { error: Some(&large), ..row(&small) }], &usual).contains("5x4"));
    assert!(refused(&vec![row(&small); MAX_ROWS + 1], &usual).contains("64"));
    assert!(refused(&[row(&empty)], &usual).contains("empty"));
    assert!(refused(&[row(&broken)], &usual).contains("0 values"));
    assert!(refused(&[row(&small)], &Options { zoom: 0, ..usual.clone() }).contains("zoom"));
    assert!(refused(&[row(&small)], &Options { closeup_px: 257, ..usual.clone() }).contains("256"));
    for outside in [[0, 0, 5, 1], [u32::MAX, 0, 2, 2], [0, 0, 0, 1], [0, 0, 4, 49]] {
        let options = Options { closeups: Some(vec![outside]), ..usual.clone() };
        assert!(refused(&[row(&small)], &options).contains("not in the picture"), "{outside:?}");
    }
    let options = Options { closeups: Some(vec![[0, 0, 1, 1]; 3]), ..usual };
    assert!(refused(&[row(&small)], &options).contains("2 is the most"));
}
