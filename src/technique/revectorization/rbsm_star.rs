//! Improved revectorization-based shadow mapping, RBSM*.

use super::rbsm_pass::Revectorization;
use super::revectorized::{self, DEPTH_BIAS, MAX_DISTANCE, NORMAL_OFFSET, RECEIVER, SKIP, SLACK};
use crate::technique::{Info, Kind};

/// The registry entry.
pub const INFO: Info = Info {
    id: "rbsm-star",
    title: "Improved revectorization, RBSM*",
    paper: "Macedo, Apolinário 2018, eq. 5-7",
    summary: "Lines that meet in the middle of every step: straight edges where the map has stairs, without growing the shadow.",
    params: &[RECEIVER, MAX_DISTANCE, NORMAL_OFFSET, DEPTH_BIAS, SLACK, SKIP],
    published: &[("receiver", "fixed"), ("depth_bias", "1.5")],
    needs: &[],
    kind: Kind::RealTime(|context, setup| revectorized::prepare(context, setup, Revectorization::Star)),
};
