//! Shaders and constants of a pipeline, and its compiler's statistics (`VK_KHR_pipeline_executable_properties`).

use super::Device;
use super::interface::{Constant, Interface};
use crate::Result;
use crate::error::VkContext;
use ash::vk;
use std::ffi::CStr;

/// Description of a pipeline.
#[derive(Clone, Debug, PartialEq)]
pub struct PipelineInfo {
    /// Name: the shader's for a compute pipeline, the state's for a raster pipeline.
    pub name: String,
    /// Shaders of the stages, in the stages' order.
    pub shaders: Vec<&'static str>,
    /// Specialization constants: the name and the bits of the value of each.
    pub constants: Vec<Constant>,
    /// Programs that the driver compiled from the stages. Empty unless the device was made with
    /// [`crate::DeviceFeatures::executable_statistics`].
    pub executables: Vec<Executable>,
}

/// Program that a driver compiled from one stage of a pipeline, or from several.
#[derive(Clone, Debug, PartialEq)]
pub struct Executable {
    /// The driver's name for it.
    pub name: String,
    /// Stages that it runs.
    pub stages: vk::ShaderStageFlags,
    /// Threads of a subgroup; 0 if the driver does not say.
    pub subgroup_size: u32,
    /// Figures of the compiler.
    pub statistics: Vec<Statistic>,
}

/// Figure of a compiler.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistic {
    /// The driver's name for it.
    pub name: String,
    /// The figure.
    pub value: StatisticValue,
}

/// Value of a [`Statistic`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StatisticValue {
    /// Yes or no.
    Bool(bool),
    /// A signed number.
    Signed(i64),
    /// A number that is never negative.
    Unsigned(u64),
    /// A number with a fraction.
    Float(f64),
}

impl StatisticValue {
    /// The value as a floating-point number; true is 1.
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Bool(b) => b.into(),
            Self::Signed(n) => n as f64,
            Self::Unsigned(n) => n as f64,
            Self::Float(x) => x,
        }
    }
}

impl Device {
    /// Flags that every pipeline is made with.
    pub(super) fn pipeline_flags(&self) -> vk::PipelineCreateFlags {
        match self.executables {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        }
    }
}

impl PipelineInfo {
    /// Describes the pipeline `handle`, which was made with the interface.
    pub(super) fn new(interface: &Interface, handle: vk::Pipeline) -> Result<Self> {
        Ok(Self {
            name: interface.name.clone(),
            shaders: interface.shaders.clone(),
            constants: interface.values.clone(),
            executables: executables(&interface.device, handle, &interface.name)?,
        })
    }
}

fn executables(device: &Device, pipeline: vk::Pipeline, name: &str) -> Result<Vec<Executable>> {
    let Some(functions) = &device.executables else { return Ok(vec![]) };
    let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
    // SAFETY: the pipeline is alive and belongs to the device, whose feature pipelineExecutableInfo is on.
    let found = unsafe { functions.get_pipeline_executable_properties(&info) }
        .context(format!("vkGetPipelineExecutablePropertiesKHR({name})"))?;
    let executable = |(index, properties): (u32, &vk::PipelineExecutablePropertiesKHR<'_>)| {
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index);
        // SAFETY: as above; the pipeline was made with CAPTURE_STATISTICS, and the driver has just counted its executables.
        let statistics = unsafe { functions.get_pipeline_executable_statistics(&info) }
            .context(format!("vkGetPipelineExecutableStatisticsKHR({name})"))?;
        Ok(Executable {
            name: text(properties.name_as_c_str()),
            stages: properties.stages,
            subgroup_size: properties.subgroup_size,
            statistics: statistics.iter().map(statistic).collect(),
        })
    };
    (0..).zip(&found).map(executable).collect()
}

fn statistic(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> Statistic {
    type Format = vk::PipelineExecutableStatisticFormatKHR;
    let value = statistic.value;
    // SAFETY: the format says which field of the union the driver wrote. A format unknown to this code is read as the
    // 64 bits that every field lies in.
    let value = unsafe {
        match statistic.format {
            Format::BOOL32 => StatisticValue::Bool(value.b32 != vk::FALSE),
            Format::INT64 => StatisticValue::Signed(value.i64),
            Format::FLOAT64 => StatisticValue::Float(value.f64),
            _ => StatisticValue::Unsigned(value.u64),
        }
    };
    Statistic { name: text(statistic.name_as_c_str()), value }
}

fn text(name: std::result::Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map_or_else(|_| String::new(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_statistic_is_read_by_its_format() {
        type Format = vk::PipelineExecutableStatisticFormatKHR;
        type Value = vk::PipelineExecutableStatisticValueKHR;
        let read = |format, value| {
            let raw = vk::PipelineExecutableStatisticKHR { format, value, ..Default::default() };
            statistic(&raw.name(c"Code size").unwrap()).value
        };
        assert_eq!(read(Format::BOOL32, Value { b32: vk::TRUE }), StatisticValue::Bool(true));
        assert_eq!(read(Format::INT64, Value { i64: -3 }), StatisticValue::Signed(-3));
        assert_eq!(read(Format::UINT64, Value { u64: u64::MAX }), StatisticValue::Unsigned(u64::MAX));
        assert_eq!(read(Format::FLOAT64, Value { f64: 0.5 }), StatisticValue::Float(0.5));
        let values = [StatisticValue::Bool(true), StatisticValue::Signed(-3), StatisticValue::Unsigned(7)];
        assert_eq!(values.map(StatisticValue::as_f64), [1.0, -3.0, 7.0]);
    }
}
