//! Finding an adapter and opening the one device that all GPU backends of a process share.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};

#[derive(Clone)]
pub(crate) struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) info: wgpu::AdapterInfo,
    /// The first thing that went wrong where nobody asked.
    trouble: Arc<Mutex<Option<String>>>,
}

impl Device {
    /// The device answers no more, because of `why`.
    pub(crate) fn lost(&self, why: &dyn std::fmt::Display) -> Error {
        let words = why.to_string();
        let words: Vec<&str> = words.split_whitespace().collect();
        Error::gpu_lost(format!(
            "{} stopped answering: {}; start again, or use the cpu backend",
            self.info.name,
            words.join(" ")
        ))
    }

    /// A buffer with room for `size` bytes; one that the host writes into is mapped.
    pub(super) fn buffer(&self, name: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: size.max(16).next_multiple_of(16),
            usage,
            mapped_at_creation: usage.contains(wgpu::BufferUsages::MAP_WRITE),
        })
    }

    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    pub(super) fn shader(&self, name: &str, wgsl: String) -> wgpu::ShaderModule {
        let source = wgpu::ShaderSource::Wgsl(wgsl.into());
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source })
    }

    /// Whether a processor stands in for a GPU.
    pub(crate) fn is_processor(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Keeps what went wrong, if it is the first that did.
    pub(crate) fn note(&self, what: &str) {
        self.trouble.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| what.to_owned());
    }

    /// Gives an error that no call has reported yet.
    pub(crate) fn check(&self) -> Result<()> {
        match &*self.trouble.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(why) => Err(self.lost(why)),
            None => Ok(()),
        }
    }
}

/// What there is to run on, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct AdapterSummary {
    /// The adapter's own name.
    pub name: String,
    /// `Vulkan`, `Metal`, `Dx12`.
    pub api: String,
    /// `discrete GPU`, `software`, and so on.
    pub kind: &'static str,
    /// Driver and version.
    pub driver: String,
    /// The maker's number on the PCI bus, where it is one.
    pub vendor: u32,
    /// Why it cannot run the GPU backend: a limit that every WebGPU device reaches and this one does not.
    pub unfit: Option<String>,
}

/// Opening devices in parallel has crashed drivers: one at a time, and the first is kept for all.
static SHARED: Mutex<Option<Device>> = Mutex::new(None);

/// The process's device; opened on the first call.
pub(crate) fn shared() -> Result<Device> {
    shared_if(|_| Ok(()))
}

/// The process's device, if it is not the CPU itself; opened on the first call.
pub(crate) fn hardware() -> Result<Device> {
    shared_if(|info| match info.device_type {
        wgpu::DeviceType::Cpu => {
            Err(Error::no_adapter(format!("the only adapter, {}, computes on the same CPU", info.name)))
        }
        _ => Ok(()),
    })
}

/// The process's device, if `accept` has nothing against its adapter; else it is not even opened.
fn shared_if(accept: impl Fn(&wgpu::AdapterInfo) -> Result<()>) -> Result<Device> {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    // One that was lost does not come back; another may be had.
    if let Some(device) = shared.as_ref().filter(|device| device.check().is_ok()) {
        return accept(&device.info).map(|()| device.clone());
    }
    let adapter = best(wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12)?;
    accept(&adapter.get_info())?;
    let device = device_of(&adapter, wgpu::Features::empty())?;
    *shared = Some(device.clone());
    Ok(device)
}

/// Opens the best adapter of `backends` with the limits that every WebGPU device has.
#[cfg(test)]
pub(crate) fn open(backends: wgpu::Backends) -> Result<Device> {
    open_with(backends, wgpu::Features::empty())
}

/// A device of its own whose clock may be read, where the adapter lets anybody.
pub(super) fn with_clock() -> Result<Device> {
    let _alone = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    open_with(wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12, wgpu::Features::TIMESTAMP_QUERY)
}

/// Opens the best adapter with those of `features` that it has.
fn open_with(backends: wgpu::Backends, features: wgpu::Features) -> Result<Device> {
    device_of(&best(backends)?, features)
}

/// The best adapter of `backends`: one that is not hardware only where there is no other.
fn best(backends: wgpu::Backends) -> Result<wgpu::Adapter> {
    pollster::block_on(async {
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
    })
}

fn device_of(adapter: &wgpu::Adapter, features: wgpu::Features) -> Result<Device> {
    let info = adapter.get_info();
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("somatic"),
        required_features: adapter.features() & features,
        required_limits: wgpu::Limits::default(),
        ..wgpu::DeviceDescriptor::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
        .map_err(|e| Error::no_adapter(format!("{} cannot be used: {e}", info.name)))?;
    let trouble = Arc::new(Mutex::new(None));
    let (of_errors, of_loss) = (trouble.clone(), trouble.clone());
    let note = |trouble: &Mutex<Option<String>>, what: String| {
        trouble.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
    };
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&of_errors, error.to_string())));
    device.set_device_lost_callback(move |_, why| {
        note(&of_loss, if why.is_empty() { "the device was lost".to_owned() } else { why });
    });
    Ok(Device { device, queue, info, trouble })
}

/// Every adapter that has a driver.
#[must_use]
pub fn adapters() -> Vec<AdapterSummary> {
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let found = pollster::block_on(instance(backends).enumerate_adapters(backends));
    let unfit = |adapter: &wgpu::Adapter| {
        let mut first = None;
        wgpu::Limits::default().check_limits_with_fail_fn(&adapter.limits(), false, |name, needed, there| {
            first.get_or_insert_with(|| format!("its {name} is {there}, and {needed} is needed"));
        });
        first
    };
    found.iter().map(|adapter| AdapterSummary { unfit: unfit(adapter), ..summary(&adapter.get_info()) }).collect()
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
        vendor: info.vendor,
        unfit: None,
    }
}

fn instance(backends: wgpu::Backends) -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends = backends;
    descriptor.backend_options.noop.enable = backends.contains(wgpu::Backends::NOOP);
    wgpu::Instance::new(descriptor)
}
