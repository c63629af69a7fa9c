//! Choice of the physical device.

use super::{no_driver, owner};
use crate::context::requirements;
use crate::error::VkContext;
use crate::{Error, Result, loader};
use ash::vk;
use std::ffi::CStr;

/// Description of a physical device.
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
    /// Requirements of the techniques that the device lacks; empty if it meets all.
    pub missing: Vec<String>,
}

impl DeviceInfo {
    pub(super) fn new(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Self {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the physical device belongs to the instance, which has version 1.3.
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

/// Requirement that null hardware does not meet, as errors name it.
const NO_MEMORY: &str = "memory: it cannot render";

/// Index of the queue family that everything runs on.
pub(super) fn queue_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    families.iter().position(|f| f.queue_count > 0 && f.queue_flags.contains(wanted)).map(|i| i as u32)
}

/// Lists which of two basics a device lacks: memory, and a queue for graphics and compute. No device can render without
/// them. Drivers may offer devices without hardware that only compile shaders, such as RADV's null device.
fn missing_hardware(
    memory: &vk::PhysicalDeviceMemoryProperties,
    families: &[vk::QueueFamilyProperties],
) -> Vec<String> {
    let mut missing = vec![];
    let heaps = memory.memory_heaps_as_slice();
    let is_usable = |t: &vk::MemoryType| heaps.get(t.heap_index as usize).is_some_and(|heap| heap.size > 0);
    if !memory.memory_types_as_slice().iter().any(is_usable) {
        missing.push(NO_MEMORY.into());
    }
    if queue_family(families).is_none() {
        missing.push("a queue with graphics and compute".into());
    }
    missing
}

fn missing(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<String> {
    // SAFETY: the physical device belongs to the instance, here and below.
    let memory = unsafe { instance.get_physical_device_memory_properties(physical_device) };
    // SAFETY: as above.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical_device) };
    let mut missing = missing_hardware(&memory, &families);
    // SAFETY: as above.
    missing.extend(unsafe { requirements().missing(instance, physical_device) });
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

/// All physical devices that the drivers offer.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let _lists = loader::change();
    let entry = owner::entry()?;
    let instance = owner::instance(&entry, false, false)?;
    let list = enumerate(&instance);
    // SAFETY: nothing was made from the instance.
    unsafe { instance.destroy_instance(None) };
    Ok(list?.into_iter().map(|(_, info)| info).collect())
}

/// The requested device, or else a device of the fastest kind among those that meet the requirements. With
/// `compile_only`, memory is not among the requirements.
pub(super) fn choose(instance: &ash::Instance, wanted: Option<&str>, compile_only: bool) -> Result<vk::PhysicalDevice> {
    let (handles, mut infos): (Vec<_>, Vec<_>) = enumerate(instance)?.into_iter().unzip();
    if infos.is_empty() {
        return Err(no_driver("no Vulkan device was found"));
    }
    if compile_only {
        infos.iter_mut().for_each(excuse_memory);
    }
    pick(&infos, wanted).map(|i| handles[i])
}

/// Takes memory off the list of what a device lacks.
fn excuse_memory(device: &mut DeviceInfo) {
    device.missing.retain(|missing| missing != NO_MEMORY);
}

/// Index of the device requested by index or part of its name, or else of a device of the fastest kind. Skips devices
/// that lack something, even if their name matches.
fn pick(devices: &[DeviceInfo], wanted: Option<&str>) -> Result<usize> {
    let index = wanted.and_then(|text| text.parse().ok()).filter(|&i: &usize| i < devices.len());
    let is_wanted = |i: usize, d: &DeviceInfo| match (index, wanted) {
        (Some(index), _) => i == index,
        (None, Some(text)) => d.name.to_lowercase().contains(&text.to_lowercase()),
        (None, None) => true,
    };
    let matches: Vec<_> = devices.iter().enumerate().filter(|&(i, d)| is_wanted(i, d)).collect();
    let fit = matches.iter().filter(|(_, d)| d.missing.is_empty());
    // Among devices that match the name the first one wins; without a name the kind decides.
    if let Some((i, _)) = fit.min_by_key(|(_, d)| if wanted.is_some() { 0 } else { d.rank() }) {
        return Ok(*i);
    }
    let list = || {
        let line = |(i, d): (usize, &DeviceInfo)| match d.missing.is_empty() {
            true => format!("  {i}: {} ({})", d.name, d.kind),
            false => format!("  {i}: {} ({}), lacks {}", d.name, d.kind, d.missing.join(", ")),
        };
        devices.iter().enumerate().map(line).collect::<Vec<_>>().join("\n")
    };
    Err(Error::NoDevice(match (wanted, matches.first()) {
        (Some(_), Some((_, d))) => format!("{} lacks {}", d.name, d.missing.join(", ")),
        (Some(text), None) => format!("no device matches {text:?}; there are:\n{}", list()),
        (None, _) => format!("no device meets the requirements:\n{}", list()),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(name: &str, kind: &'static str, missing: &[&str]) -> DeviceInfo {
        DeviceInfo {
            name: name.into(),
            driver: "made up".into(),
            kind,
            vulkan: "1.3.0".into(),
            missing: missing.iter().map(|&m| m.into()).collect(),
        }
    }

    fn family(flags: vk::QueueFlags) -> vk::QueueFamilyProperties {
        vk::QueueFamilyProperties { queue_flags: flags, queue_count: 1, ..Default::default() }
    }

    #[test]
    fn the_fastest_kind_that_renders_is_taken() {
        let null = device("Null hardware (RADV NAVI21)", "discrete", &["memory: it cannot render"]);
        let cpu = device("llvmpipe", "cpu", &[]);
        let gpu = device("Radeon RX 6800 (RADV NAVI21)", "discrete", &[]);
        let devices = [null.clone(), cpu.clone(), gpu.clone()];
        assert_eq!(pick(&devices, None).unwrap(), 2);
        assert_eq!(pick(&[null.clone(), cpu.clone()], None).unwrap(), 1);
        assert_eq!(pick(&devices, Some("LLVM")).unwrap(), 1);
        assert_eq!(pick(&devices, Some("1")).unwrap(), 1);
        // The first device of that name that can render.
        assert_eq!(pick(&devices, Some("navi21")).unwrap(), 2);
        assert_eq!(pick(&[cpu.clone(), device("llvmpipe", "discrete", &[])], Some("llvmpipe")).unwrap(), 0);
        let error = |devices: &[_], wanted| pick(devices, wanted).unwrap_err().to_string();
        for wanted in ["null", "0"] {
            let error = error(&devices, Some(wanted));
            assert!(error.contains("Null hardware (RADV NAVI21) lacks memory: it cannot render"), "{error}");
        }
        // Without memory it can still compile, but without the rest it cannot.
        let excused = |missing: &[&str]| {
            let mut device = device("Null hardware (RADV NAVI21)", "discrete", missing);
            excuse_memory(&mut device);
            device
        };
        assert_eq!(pick(&[cpu.clone(), excused(&[NO_MEMORY])], None).unwrap(), 1);
        assert_eq!(excused(&[NO_MEMORY, "the feature synchronization2"]).missing, ["the feature synchronization2"]);
        let error_none = error(&[null], None);
        assert!(error_none.contains("0: Null hardware (RADV NAVI21) (discrete), lacks memory"), "{error_none}");
        let error = error(&devices, Some("GeForce"));
        assert!(error.contains("no device matches \"GeForce\"") && error.contains("1: llvmpipe (cpu)\n"), "{error}");
    }

    #[test]
    fn a_device_without_memory_or_queue_cannot_render() {
        let queues = [family(vk::QueueFlags::TRANSFER), family(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE)];
        assert_eq!(queue_family(&queues), Some(1));
        assert_eq!(queue_family(&[vk::QueueFamilyProperties { queue_count: 0, ..queues[1] }]), None);
        let mut memory = vk::PhysicalDeviceMemoryProperties { memory_type_count: 1, ..Default::default() };
        memory.memory_heap_count = 1;
        memory.memory_heaps[0].size = 1 << 30;
        assert_eq!(missing_hardware(&memory, &queues), [""; 0]);
        assert_eq!(missing_hardware(&memory, &queues[..1]), ["a queue with graphics and compute"]);
        let none = ["memory: it cannot render"];
        assert_eq!(missing_hardware(&vk::PhysicalDeviceMemoryProperties::default(), &queues), none);
        memory.memory_heaps[0].size = 0;
        assert_eq!(missing_hardware(&memory, &queues), none);
    }
}
