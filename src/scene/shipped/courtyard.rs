use super::kit::Stage;
use crate::scene::Scene;

pub(super) fn stage() -> Scene {
    Stage::new("courtyard").scene
}
