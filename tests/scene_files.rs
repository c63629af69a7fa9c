//! glTF files: what a scene holds after loading, and what broken files are told.
#![cfg(feature = "app")]

mod gltf_files;
