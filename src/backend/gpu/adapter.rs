//! Finding an adapter and opening the one device that all GPU backends of a process share.

use std::sync::Mutex;

use crate::error::{Error, Result};

/// An open device, shared.
#[derive(Clone)]
pub(crate) struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) info: wgpu::AdapterInfo,
}

/// What there is to run on, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// The adapter's own name.
    pub name: String,
    /// `Vulkan`, `Metal`, `Dx12`.
    pub api: String,
    /// `discrete GPU`, `software`, and so on.
    pub kind: &'static str,
    /// Driver and version.
    pub driver: String,
}

/// Opening devices in parallel has crashed drivers: one at a time, and the first is kept for all.
static SHARED: Mutex<Option<Device>> = Mutex::new(None);

/// The process's device; opened on the first call.
pub(crate) fn shared() -> Result<Device> {
    let mut shared = SHARED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(device) = &*shared {
        return Ok(device.clone());
    }
    let device = open(wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12)?;
    *shared = Some(device.clone());
    Ok(device)
}

/// Opens the best adapter of `backends` with the limits that every WebGPU device has.
pub(crate) fn open(backends: wgpu::Backends) -> Result<Device> {
    let adapter = pollster::block_on(async {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        instance(backends).request_adapter(&options).await
    })
    .map_err(|_| {
        // What wgpu says of it names every API it was not built for.
        let remedy = "install one (on Debian, mesa-vulkan-drivers runs shaders on the CPU)";
        Error::no_adapter(format!("no GPU driver answers; {remedy}"))
    })?;
    let info = adapter.get_info();
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("somatic"),
        required_features: wgpu::Features::empty(),
        required_limits: wgpu::Limits::default(),
        ..wgpu::DeviceDescriptor::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
        .map_err(|e| Error::no_adapter(format!("{} cannot be used: {e}", info.name)))?;
    Ok(Device { device, queue, info })
}

/// Every adapter that could run the GPU backend.
#[must_use]
pub fn adapters() -> Vec<AdapterSummary> {
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let found = pollster::block_on(instance(backends).enumerate_adapters(backends));
    found.iter().map(|adapter| summary(&adapter.get_info())).collect()
}

pub(crate) fn summary(info: &wgpu::AdapterInfo) -> AdapterSummary {
    AdapterSummary {
        name: info.name.clone(),
        api: format!("{:?}", info.backend),
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        },
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
    }
}

fn instance(backends: wgpu::Backends) -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends = backends;
    descriptor.backend_options.noop.enable = backends.contains(wgpu::Backends::NOOP);
    wgpu::Instance::new(descriptor)
}
