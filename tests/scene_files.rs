//! Tests of glTF files: the scene after loading, and the errors for broken files.
#![cfg(feature = "app")]

mod gltf_files;
