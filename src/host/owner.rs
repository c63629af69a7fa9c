//! Owner of instance, device and debug messenger, which are destroyed last.

use super::{HostDesc, no_driver, select};
use crate::context::requirements;
use crate::error::VkContext;
use crate::{DeviceFeatures, Error, Result, loader};
use ash::vk;
use std::borrow::Cow;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// Messages of the validation layer, shared with its callback.
#[derive(Clone, Default)]
pub struct Messages(Arc<Mutex<Vec<String>>>);

impl Messages {
    /// All messages so far, oldest first.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn push(&self, message: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

pub(super) struct Owner {
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub queue_family: u32,
    pub debug_utils: bool,
    pub features: DeviceFeatures,
    /// True if nothing is ever submitted: [`HostDesc::compile_only`].
    pub compile_only: bool,
    pub messages: Messages,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    _entry: ash::Entry,
}

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Loads the Vulkan loader.
pub(super) fn entry() -> Result<ash::Entry> {
    // SAFETY: loading the system's Vulkan loader runs its initialisers, which are meant to be run so.
    unsafe { ash::Entry::load() }.map_err(|e| no_driver(&format!("the Vulkan loader was not found ({e})")))
}

/// Creates a bare instance for listing devices, or one with debugging for a host.
pub(super) fn instance(entry: &ash::Entry, debug_utils: bool, validation: bool) -> Result<ash::Instance> {
    let app = vk::ApplicationInfo::default()
        .application_name(c"edgeshade")
        .engine_name(c"edgeshade")
        .api_version(vk::API_VERSION_1_3);
    let layers = if validation { vec![VALIDATION.as_ptr()] } else { vec![] };
    let extensions = if debug_utils { vec![ash::ext::debug_utils::NAME.as_ptr()] } else { vec![] };
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&app)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validation {
        info = info.push_next(&mut features);
    }
    // SAFETY: every pointer of `info` outlives the call.
    unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => no_driver("no Vulkan driver was found"),
        vk::Result::ERROR_LAYER_NOT_PRESENT => Error::NoDevice(
            "the Vulkan validation layer is not installed; on Debian or Ubuntu: \
             sudo apt-get install vulkan-validationlayers"
                .into(),
        ),
        result => Error::Vulkan { call: "vkCreateInstance".into(), result },
    })
}

fn has_debug_utils(entry: &ash::Entry, validation: bool) -> bool {
    let layer = validation.then_some(VALIDATION);
    let has = |layer| {
        // SAFETY: this query has no preconditions.
        let list = unsafe { entry.enumerate_instance_extension_properties(layer) }.unwrap_or_default();
        list.iter().any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME))
    };
    has(None) || layer.is_some() && has(layer)
}

impl Owner {
    pub fn new(desc: &HostDesc) -> Result<Self> {
        let mut owner = Self::open(desc)?;
        if desc.validation && owner.debug_utils {
            owner.listen()?;
        }
        Ok(owner)
    }

    fn open(desc: &HostDesc) -> Result<Self> {
        let _lists = loader::change();
        let entry = entry()?;
        let debug_utils = has_debug_utils(&entry, desc.validation);
        let instance = instance(&entry, debug_utils, desc.validation)?;
        let destroy = |e: Error| {
            // SAFETY: nothing was made from the instance yet.
            unsafe { instance.destroy_instance(None) };
            e
        };
        let physical_device = select::choose(&instance, desc.device.as_deref(), desc.compile_only).map_err(destroy)?;
        // SAFETY: the physical device belongs to the instance.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical_device) };
        let queue_family = select::queue_family(&families)
            .ok_or_else(|| destroy(Error::NoDevice("the device has no queue with graphics and compute".into())))?;
        // SAFETY: as above; `choose` returns devices of at least version 1.3.
        let mut features = unsafe { DeviceFeatures::of(&instance, physical_device) };
        features.executable_statistics = desc.compile_only && has_executable_statistics(&instance, physical_device);
        let device = create_device(&instance, physical_device, queue_family, features).map_err(destroy)?;
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        Ok(Self {
            instance,
            physical_device,
            device,
            queue,
            queue_family,
            debug_utils,
            features,
            compile_only: desc.compile_only,
            messages: Messages::default(),
            messenger: None,
            _entry: entry,
        })
    }

    fn listen(&mut self) -> Result<()> {
        let debug = ash::ext::debug_utils::Instance::new(&self._entry, &self.instance);
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&self.messages.0).cast_mut().cast());
        // SAFETY: the messages outlive the messenger: both belong to this owner.
        let messenger =
            unsafe { debug.create_debug_utils_messenger(&info, None) }.context("vkCreateDebugUtilsMessengerEXT")?;
        self.messenger = Some((debug, messenger));
        Ok(())
    }
}

fn has_executable_statistics(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device belongs to the instance, here and below.
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical_device) }.unwrap_or_default();
    let name = ash::khr::pipeline_executable_properties::NAME;
    if !extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name)) {
        return false;
    }
    let mut feature = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
    let mut has = vk::PhysicalDeviceFeatures2::default().push_next(&mut feature);
    // SAFETY: as above; the device has the extension of the struct.
    unsafe { instance.get_physical_device_features2(physical_device, &mut has) };
    feature.pipeline_executable_info == vk::TRUE
}

fn create_device(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    queue_family: u32,
    available: DeviceFeatures,
) -> Result<ash::Device> {
    let needed = requirements();
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
    let mut extensions: Vec<_> = needed.extensions.iter().map(|e| e.as_ptr()).collect();
    // SAFETY: the physical device belongs to the instance.
    let offered = unsafe { instance.get_physical_device_features(physical_device) };
    let mut features = vk::PhysicalDeviceFeatures {
        // All meshes share one vertex buffer. Without this feature indices may end at 2^24 - 1.
        full_draw_index_uint32: offered.full_draw_index_uint32,
        ..needed.features
    };
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default().scalar_block_layout(true);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default().synchronization2(true);
    // The host's raster passes need some of these features (`select` has checked them), and techniques need others.
    available.enable(&mut features, &mut v12, &mut v13);
    let mut executables =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    if available.executable_statistics {
        extensions.push(ash::khr::pipeline_executable_properties::NAME.as_ptr());
    }
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v12)
        .push_next(&mut v13);
    if available.executable_statistics {
        info = info.push_next(&mut executables);
    }
    // SAFETY: `select::choose` has checked the extensions and features.
    unsafe { instance.create_device(physical_device, &info, None) }.context("vkCreateDevice")
}

impl Drop for Owner {
    fn drop(&mut self) {
        let _lists = loader::change();
        // SAFETY: everything made from the device held this owner and is gone.
        unsafe {
            // Null hardware has nothing that could be waited for: RADV crashes.
            if !self.compile_only {
                let _ = self.device.device_wait_idle();
            }
            self.device.destroy_device(None);
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `user` is the pointer set by `listen`.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map_or(Cow::Borrowed("(no text)"), CStr::to_string_lossy).into_owned();
        Arc::increment_strong_count(user.cast::<Mutex<Vec<String>>>().cast_const());
        (text, Messages(Arc::from_raw(user.cast::<Mutex<Vec<String>>>().cast_const())))
    };
    messages.push(format!("{severity:?}: {text}"));
    vk::FALSE
}
