//! Embedding of Edgeshade in an engine that was written without it; see `engine.rs`.
//!
//! `cargo run --no-default-features --example embed -- [sm|pcf] [standard-depth] [normals] [d16] [throw-away]
//! [validate]` draws and checks some frames. With `--mistakes` it makes every mistake that Edgeshade must reject, and
//! prints the errors.

mod engine;
mod gpu;
mod mistakes;
mod scene;

use ash::vk;
use edgeshade::view::DepthRange;

const EXTENT: [u32; 2] = [640, 480];
const FRAMES: u32 = 24;

fn main() -> gpu::Result<()> {
    let words: Vec<_> = std::env::args().skip(1).collect();
    if words == ["--mistakes"] {
        for (mistake, answer) in mistakes::all()? {
            println!("{mistake}\n    -> {answer}");
        }
        return Ok(());
    }
    let known = ["sm", "pcf", "standard-depth", "normals", "d16", "throw-away", "validate", "--mistakes"];
    if let Some(unknown) = words.iter().find(|w| !known.contains(&w.as_str())) {
        return Err(format!("unknown argument {unknown:?}; there are: {}", known.join(", ")).into());
    }
    let has = |word: &str| words.iter().any(|w| w == word);
    let depth = if has("standard-depth") { DepthRange::Standard } else { DepthRange::Reversed };
    let messages = gpu::Messages::default();
    let mut engine = engine::Engine::new(&engine::Options {
        technique: if has("sm") { "sm" } else { "pcf" },
        params: if has("sm") { &[] } else { &[("width", "5"), ("skip", "tiles")] },
        extent: EXTENT,
        depth,
        normals: has("normals"),
        map_format: if has("d16") { vk::Format::D16_UNORM } else { vk::Format::D32_SFLOAT },
        throw_away: has("throw-away"),
        validation: has("validate").then(|| messages.clone()),
    })?;
    // Reads back and compares only every second picture. Most engines never read back, and the wait must not hide a
    // missing barrier.
    let mut pictures = vec![];
    for frame in 0..FRAMES {
        let views = std::array::from_fn(|view| scene::moment(frame, view, EXTENT, depth));
        pictures.extend(engine.draw(views, frame % 2 == 1)?);
    }
    pictures.extend(engine.finish()?);

    let mut wrong = 0;
    for (i, (moment, pixels)) in pictures.iter().enumerate() {
        let v = moment.check(pixels, EXTENT);
        println!(
            "frame {:2}, view {}: {} sky, {} lit, {} in shadow, {} not judged, {} wrong",
            i / engine::VIEWS * 2 + 1,
            i % engine::VIEWS,
            v.sky,
            v.lit,
            v.shadow,
            v.unsure,
            v.wrong
        );
        wrong += v.wrong;
    }
    if let Some(last) = engine.times.last() {
        println!("GPU time of the last view's passes:");
        for pass in &last.passes {
            let tiles = pass.tiles.map_or(String::new(), |t| format!("  {} of {} tiles", t.active, t.total));
            println!("  {:16} {:8.3} ms{tiles}", pass.name, pass.gpu_ms);
        }
        println!("  {:16} {:8.3} ms", "total", last.total_gpu_ms);
    }
    drop(engine);
    let messages = messages.lock().unwrap();
    messages.iter().for_each(|m| eprintln!("{m}"));
    if wrong > 0 || !messages.is_empty() {
        return Err(format!("{wrong} wrong pixels, {} messages of the validation layer", messages.len()).into());
    }
    Ok(())
}
