//! A lock around what the Vulkan loader leaves open to races.
//!
//! Vulkan allows threads to use different instances and devices at once. The Khronos loader (seen in 1.4.309, read in
//! its source) keeps all of them in process-wide lists. `vkSetDebugUtilsObjectNameEXT` and `vkGetDeviceProcAddr` walk
//! these lists, while `vkEnumeratePhysicalDevices`, which drops drivers without devices, `vkCreateDevice` and
//! `vkDestroyDevice` change them and free entries without the lock that the walk takes. One thread that names an object
//! while another opens a device then reads freed memory.

use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

static LISTS: RwLock<()> = RwLock::new(());

/// Held while instances and devices come and go.
pub(crate) fn change() -> RwLockWriteGuard<'static, ()> {
    LISTS.write().unwrap_or_else(PoisonError::into_inner)
}

/// Held during a call that looks a device up.
pub(crate) fn look_up() -> RwLockReadGuard<'static, ()> {
    LISTS.read().unwrap_or_else(PoisonError::into_inner)
}
