//! Which physical device to use.

use super::{no_driver, owner};
use crate::context::requirements;
use crate::error::VkContext;
use crate::{Error, Result};
use ash::vk;
use std::ffi::CStr;

/// What a physical device is.
#[derive(Clone, Debug, serde::Serialize)]
pub struct DeviceInfo {
    /// The device's own name.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: &'static str,
    /// Vulkan version, `major.minor.patch`.
    pub vulkan: String,
    /// What it lacks to run the techniques; empty if it has all.
    pub missing: Vec<String>,
}

impl DeviceInfo {
    pub(super) fn new(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Self {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the physical device is the instance's, which is of version 1.3.
        unsafe { instance.get_physical_device_properties2(physical_device, &mut properties) };
        let p = properties.properties;
        let text = |s: std::result::Result<&CStr, _>| {
            s.map_or_else(|_: std::ffi::FromBytesUntilNulError| String::new(), |s| s.to_string_lossy().into_owned())
        };
        let v = p.api_version;
        Self {
            name: text(p.device_name_as_c_str()),
            driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
            kind: match p.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
                vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
                vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
                vk::PhysicalDeviceType::CPU => "cpu",
                _ => "other",
            },
            vulkan: format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v)),
            missing: missing(instance, physical_device),
        }
    }

    fn rank(&self) -> usize {
        ["discrete", "integrated", "virtual", "cpu"].iter().position(|k| *k == self.kind).unwrap_or(4)
    }
}

fn missing(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<String> {
    // SAFETY: the physical device is the instance's.
    let mut missing = unsafe { requirements().missing(instance, physical_device) };
    if missing.is_empty() {
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut has = vk::PhysicalDeviceFeatures2::default().push_next(&mut v13);
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(physical_device, &mut has) };
        let geometry = has.features.geometry_shader;
        if v13.dynamic_rendering == vk::FALSE {
            missing.push("the feature dynamicRendering".into());
        }
        if geometry == vk::FALSE {
            missing.push("the feature geometryShader (for triangle ids)".into());
        }
    }
    missing
}

fn enumerate(instance: &ash::Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
    // SAFETY: the instance is alive.
    let list = unsafe { instance.enumerate_physical_devices() }.context("vkEnumeratePhysicalDevices")?;
    Ok(list.into_iter().map(|d| (d, DeviceInfo::new(instance, d))).collect())
}

/// Every physical device that the drivers offer.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let entry = owner::entry()?;
    let instance = owner::instance(&entry, false, false)?;
    let list = enumerate(&instance);
    // SAFETY: nothing was made from it.
    unsafe { instance.destroy_instance(None) };
    Ok(list?.into_iter().map(|(_, info)| info).collect())
}

/// The device asked for, or the fastest kind that has all that is needed.
pub(super) fn choose(instance: &ash::Instance, wanted: Option<&str>) -> Result<vk::PhysicalDevice> {
    let list = enumerate(instance)?;
    if list.is_empty() {
        return Err(no_driver("no Vulkan device was found"));
    }
    let describe = |infos: &[(vk::PhysicalDevice, DeviceInfo)]| {
        let line = |(i, (_, d)): (usize, &(_, DeviceInfo))| match d.missing.is_empty() {
            true => format!("  {i}: {} ({})", d.name, d.kind),
            false => format!("  {i}: {} ({}), lacks {}", d.name, d.kind, d.missing.join(", ")),
        };
        infos.iter().enumerate().map(line).collect::<Vec<_>>().join("\n")
    };
    let found = match wanted {
        Some(text) => list
            .iter()
            .enumerate()
            .find(|(i, (_, d))| text.parse() == Ok(*i) || d.name.to_lowercase().contains(&text.to_lowercase())),
        None => list.iter().enumerate().filter(|(_, (_, d))| d.missing.is_empty()).min_by_key(|(_, (_, d))| d.rank()),
    };
    match found {
        Some((_, (device, info))) if info.missing.is_empty() => Ok(*device),
        Some((_, (_, info))) => Err(Error::NoDevice(format!("{} lacks {}", info.name, info.missing.join(", ")))),
        None if wanted.is_some() => {
            let wanted = wanted.unwrap_or_default();
            Err(Error::NoDevice(format!("no device matches {wanted:?}; there are:\n{}", describe(&list))))
        }
        None => Err(Error::NoDevice(format!("no device has all that is needed:\n{}", describe(&list)))),
    }
}
