//! Bindings that most passes share.

use super::view::ViewConstants;
use crate::gpu::{Bindings, Buffer, Declared, Image, bindings};
use crate::{Bind, Inputs};

/// The constants of the frame, and the camera's depth and normals.
#[derive(Clone, Copy)]
pub(crate) struct CameraBindings<'a> {
    view: Bind<'a>,
    camera_depth: Bind<'a>,
    camera_normal: Bind<'a>,
}

impl<'a> CameraBindings<'a> {
    /// Makes the bindings. `view` is the buffer of [`super::view::ViewBuffer`].
    pub fn new(view: &'a Buffer, inputs: &'a Inputs<'_>) -> Self {
        Self {
            view: Bind::Buffer(view),
            camera_depth: Bind::Input(&inputs.depth),
            camera_normal: Bind::Input(inputs.normal_or_depth()),
        }
    }
}

impl Bindings for CameraBindings<'_> {
    fn declare(all: &mut Vec<Declared>) {
        all.push(Declared::uniform::<ViewConstants>("view"));
        all.extend(["camera_depth", "camera_normal"].map(Declared::new));
    }

    fn add<'a>(&'a self, all: &mut Vec<(&'static str, Bind<'a>)>) {
        let Self { view, camera_depth, camera_normal } = *self;
        all.extend([("view", view), ("camera_depth", camera_depth), ("camera_normal", camera_normal)]);
    }
}

bindings! {
    /// The bindings of the camera, and the shadow map.
    pub(crate) struct ReceiverBindings { ..camera: CameraBindings, shadow_map }

    /// Resources of a pass that writes the visibility of all pixels or of the listed pixels; see [`super::pixels`].
    pub(crate) struct PixelBindings { ..receiver: ReceiverBindings, visibility, list }
}

impl<'a> ReceiverBindings<'a> {
    /// Makes the bindings. `view` is the buffer of [`super::view::ViewBuffer`].
    pub fn new(view: &'a Buffer, inputs: &'a Inputs<'_>) -> Self {
        Self { camera: CameraBindings::new(view, inputs), shadow_map: Bind::Input(&inputs.shadow_map) }
    }

    /// Makes the bindings with the shadow map as [`Bind::BorderlessMap`].
    pub fn borderless(view: &'a Buffer, inputs: &'a Inputs<'_>) -> Self {
        Self { shadow_map: Bind::BorderlessMap(&inputs.shadow_map), ..Self::new(view, inputs) }
    }
}

impl<'a> PixelBindings<'a> {
    /// `view` is of [`super::view::ViewBuffer`].
    pub fn new(view: &'a Buffer, inputs: &'a Inputs<'_>, output: &'a Image, list: Bind<'a>) -> Self {
        Self { receiver: ReceiverBindings::new(view, inputs), visibility: Bind::Image(output), list }
    }

    /// The same with [`Bind::BorderlessMap`].
    pub fn borderless(view: &'a Buffer, inputs: &'a Inputs<'_>, output: &'a Image, list: Bind<'a>) -> Self {
        Self { receiver: ReceiverBindings::borderless(view, inputs), ..Self::new(view, inputs, output, list) }
    }
}
