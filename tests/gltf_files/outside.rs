//! Tests of files next to the scene file, and of files that must not be read.

use super::builder::{File, TRIANGLE, assert_world, png};
use edgeshade::scene::{Scene, load, load_bytes};
use serde_json::json;
use std::path::Path;

fn load_in(folder: &Path, file: &File) -> Result<Scene, String> {
    let path = folder.join("scene.gltf");
    std::fs::write(&path, file.text()).unwrap();
    load(&path).map_err(|e| e.to_string())
}

fn external(uri: &str) -> File {
    let mut file = File::triangle();
    file.json["buffers"] = json!([{ "byteLength": file.bin.len(), "uri": uri }]);
    file
}

#[test]
fn buffers_and_images_next_to_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = external("parts/my%20buffer.bin");
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    std::fs::write(folder.path().join("parts/my buffer.bin"), &file.bin).unwrap();
    std::fs::write(folder.path().join("größe.png"), png(1, 1, &[1, 2, 3, 4])).unwrap();
    file.json["images"] = json!([{ "uri": "./parts/../gr%C3%B6%C3%9Fe.png" }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    file.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    let scene = load_in(folder.path(), &file).unwrap();
    assert_eq!((&*scene.name, &scene.textures[0].rgba[..]), ("scene", &[[1, 2, 3, 4]][..]));
    assert_world(&scene, &TRIANGLE.map(|p| p.map(f64::from)), 0.0);
}

#[test]
fn data_uris() {
    let mut file = File::triangle();
    use base64::Engine;
    let encoded = base64::engine::general_purpose::STANDARD_NO_PAD.encode(&file.bin);
    for kind in ["application/octet-stream", "application/gltf-buffer", ""] {
        let uri = format!("data:{kind};base64,{encoded}");
        file.json["buffers"] = json!([{ "byteLength": file.bin.len(), "uri": uri }]);
        assert_eq!(load_bytes("text", &file.text()).unwrap().triangles(), 1);
    }
    let percent: String = file.bin.iter().map(|b| format!("%{b:02x}")).collect();
    file.json["buffers"] = json!([{ "byteLength": file.bin.len(), "uri": format!("data:,{percent}") }]);
    assert_eq!(load_bytes("text", &file.text()).unwrap().triangles(), 1);
}

#[test]
fn a_byte_order_mark_is_harmless() {
    let text = [b"\xef\xbb\xbf \n", &File::empty().text()[..]].concat();
    assert!(load_bytes("text", &text).is_ok());
}

#[test]
fn nothing_outside_the_folder_is_read() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("scenes");
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    let secret = root.path().join("secret.bin");
    std::fs::write(&secret, &File::triangle().bin).unwrap();
    let uris = [
        "../secret.bin".into(),
        "sub/../../secret.bin".into(),
        "%2e%2e/secret.bin".into(),
        "..%2Fsecret.bin".into(),
        "../scenes/scene.gltf".into(),
        secret.display().to_string(),
        format!("file://{}", secret.display()),
        "http://example.org/secret.bin".into(),
        "HTTPS://example.org/secret.bin".into(),
    ];
    for uri in &uris {
        let error = load_in(&folder, &external(uri)).unwrap_err();
        assert!(error.contains("buffers[0].uri: "), "{uri}: {error}");
        assert!(error.contains("only files inside the scene file's own folder are read"), "{uri}: {error}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, folder.join("link.bin")).unwrap();
        std::os::unix::fs::symlink(root.path(), folder.join("up")).unwrap();
        for uri in ["link.bin", "up/secret.bin"] {
            let error = load_in(&folder, &external(uri)).unwrap_err();
            assert!(error.contains("only files inside"), "{uri}: {error}");
        }
        // A link that stays inside the folder is allowed.
        std::fs::write(folder.join("sub/real.bin"), &File::triangle().bin).unwrap();
        std::os::unix::fs::symlink("sub/real.bin", folder.join("inner.bin")).unwrap();
        assert!(load_in(&folder, &external("inner.bin")).is_ok());
    }
}

#[test]
fn missing_short_and_odd_files() {
    let folder = tempfile::tempdir().unwrap();
    let error = load_in(folder.path(), &external("none.bin")).unwrap_err();
    assert!(error.contains("scene.gltf: buffers[0].uri: \"none.bin\": "), "{error}");
    std::fs::create_dir(folder.path().join("dir.bin")).unwrap();
    let error = load_in(folder.path(), &external("dir.bin")).unwrap_err();
    assert!(error.contains("is not a regular file"), "{error}");
    let error = load_in(folder.path(), &external("")).unwrap_err();
    assert!(error.contains("buffers[0].uri"), "{error}");
    std::fs::write(folder.path().join("short.bin"), [0; 35]).unwrap();
    let error = load_in(folder.path(), &external("short.bin")).unwrap_err();
    assert!(error.contains("buffers[0].byteLength: is 36, but only 35 bytes are there"), "{error}");
    let error = load(&folder.path().join("no such.glb")).unwrap_err().to_string();
    assert!(error.contains("no such.glb: "), "{error}");
    let error = load(folder.path()).unwrap_err().to_string();
    assert!(error.contains("is not a regular file"), "{error}");
    let error = load_bytes("embedded", &external("none.bin").text()).unwrap_err().to_string();
    assert!(error.contains("this scene has no folder"), "{error}");
    // An invalid UTF-8 byte, and a NUL byte, which would end a name in C.
    for uri in ["%ff.bin", "a%00.bin"] {
        let error = load_in(folder.path(), &external(uri)).unwrap_err();
        assert!(error.contains("buffers[0].uri"), "{uri}: {error}");
    }
}
