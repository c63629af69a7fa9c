//! `edgeshade render --explain`: work that the technique left out, and the time that this saved.

use super::args::Moves;
use super::stats;
use super::techniques::Choice;
use edgeshade::Result;
use edgeshade::scene::Renderer;
use edgeshade::table::number;
use edgeshade::timing::FrameTiming;
use serde::Serialize;

/// The object `explain` of the JSON.
#[derive(Debug, Serialize)]
pub struct Explain {
    /// Passes that worked on a list of tiles.
    decided: Vec<Decided>,
    /// Passes of the first frame that the measured ones did without.
    kept: Vec<Kept>,
    /// The same frames without the acceleration.
    skip: Option<Skip>,
}

#[derive(Debug, Serialize)]
struct Decided {
    pass: String,
    tiles_active: u32,
    tiles_total: u32,
}

#[derive(Debug, Serialize)]
struct Kept {
    pass: String,
    /// Time in the first frame.
    gpu_ms: f64,
}

#[derive(Debug, Serialize)]
struct Skip {
    value: String,
    gpu_ms: Option<f64>,
    off_gpu_ms: Option<f64>,
    /// Pixels whose visibility differs without it.
    pixels_differing: usize,
}

/// Parameter that turns the acceleration of a technique off.
const SKIP: &str = "skip";
const OFF: &str = "off";

impl Explain {
    /// Collects what `frames` left out. `first` is the frame before them, and `image` the technique's visibility. Draws as
    /// many frames with `skip=off` if the technique has that parameter.
    pub fn new(
        choice: &Choice,
        renderer: &mut Renderer<'_>,
        first: &FrameTiming,
        frames: &[FrameTiming],
        image: &[f32],
    ) -> Result<Self> {
        let tiles = stats::passes(frames).into_iter();
        let decided = tiles
            .filter_map(|p| Some(Decided { pass: p.name, tiles_active: p.tiles_active?, tiles_total: p.tiles_total? }));
        let is_kept = |name: &str| !frames.iter().any(|f| f.passes.iter().any(|p| p.name == name));
        let kept = first.passes.iter().filter(|p| is_kept(&p.name));
        let kept = kept.map(|p| Kept { pass: p.name.clone(), gpu_ms: p.gpu_ms });
        Ok(Self { decided: decided.collect(), kept: kept.collect(), skip: skip(choice, renderer, frames, image)? })
    }

    /// Lines for people.
    pub fn text(&self, moving: Moves) -> String {
        let mut lines = vec!["What was left out:".to_owned()];
        for Decided { pass, tiles_active, tiles_total } in &self.decided {
            lines
                .push(format!("  {pass}: worked on {tiles_active} of {tiles_total} tiles; the others did not need it"));
        }
        let kept_ms: f64 = self.kept.iter().map(|k| k.gpu_ms).sum();
        if !self.kept.is_empty() {
            let names: Vec<_> = self.kept.iter().map(|k| k.pass.as_str()).collect();
            lines.push(format!(
                "  kept from the first frame, which took {} ms for it and is slower than later ones: {}",
                number(Some(kept_ms), 2),
                names.join("; ")
            ));
        }
        let ran = |ms: &Option<f64>| ms.is_some_and(|ms| ms > 0.0);
        if let Some(Skip { value, gpu_ms, off_gpu_ms, pixels_differing }) =
            self.skip.as_ref().filter(|s| ran(&s.off_gpu_ms))
        {
            let [on, off] = [gpu_ms, off_gpu_ms].map(|ms| number(*ms, 2));
            let saved = gpu_ms.zip(*off_gpu_ms).map(|(on, off)| off - on);
            lines.push(format!(
                "  skip={value}: {on} ms; skip=off: {off} ms, drawn afterwards, so it saves {} ms; {pixels_differing} pixels differ",
                number(saved, 2)
            ));
        }
        if lines.len() == 1 {
            lines.push("  nothing: this technique has no counter of tiles, no parameter skip, and kept no pass".into());
        }
        if self.kept.is_empty() && moving == Moves::Everything {
            lines.push("  (With --moving camera or nothing, techniques keep what has not changed.)".into());
        }
        lines.join("\n") + "\n"
    }
}

/// Draws the same frames with `skip=off`. `None` if there is no such setting, or it is the one in use.
fn skip(choice: &Choice, renderer: &mut Renderer<'_>, frames: &[FrameTiming], image: &[f32]) -> Result<Option<Skip>> {
    let shown = choice.params.show();
    let Some((_, value)) = shown.iter().find(|(name, _)| *name == SKIP) else { return Ok(None) };
    let mut params = choice.params.clone();
    if value == OFF || params.set(choice.info.id, SKIP, OFF).is_err() {
        return Ok(None);
    }
    let mut technique = renderer.prepare(choice.info.id, &params)?;
    renderer.frame(technique.as_mut())?;
    // A technique that keeps its picture has no passes after the first frame, with or without skipping.
    let off = frames.iter().map(|_| renderer.frame(technique.as_mut())).collect::<Result<Vec<_>>>()?;
    let other = renderer.visibility(technique.as_ref())?;
    let median = |frames: &[FrameTiming]| stats::technique(frames).map(|s| s.median);
    Ok(Some(Skip {
        value: value.clone(),
        gpu_ms: median(frames),
        off_gpu_ms: median(&off),
        pixels_differing: image.iter().zip(&other).filter(|(a, b)| a.to_bits() != b.to_bits()).count(),
    }))
}
