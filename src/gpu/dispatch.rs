//! Runs passes: binds their resources and dispatches their workgroups, at once or slice after slice.

use std::time::Instant;

use ash::vk;

use super::device::Device;
use super::frame::{CommandKind, Frame};
use super::image::Image;
use super::pass::{Binding, Pass};
use super::recording::Recording;
use super::reflection::Resource;
use super::slices::{Rows, SLICE_MS, Slices};
use crate::error::Result;

impl<'r> Recording<'_, 'r> {
    /// Runs `pass` over at least `threads` threads along x, y and z; the shader drops the excess.
    pub fn dispatch<P: bytemuck::NoUninit>(
        &mut self,
        pass: &'r Pass,
        bindings: &[(&str, Binding<'r>)],
        push: &P,
        threads: [u32; 3],
    ) -> Result<()> {
        self.dispatch_groups(pass, bindings, push, [0; 3], pass.groups(threads))
    }

    fn bind(&mut self, pass: &'r Pass, bindings: &[(&str, Binding<'r>)]) -> Result<()> {
        check_names(pass, bindings)?;
        let mut descriptors = Vec::with_capacity(pass.resources.len());
        for declared in &pass.resources {
            let (_, bound) = bindings
                .iter()
                .find(|(name, _)| *name == declared.name)
                .ok_or_else(|| pass.unfit(format!("{} is not bound", declared.name)))?;
            let descriptor = Descriptor::of(bound, declared, pass, &self.frame.device)?;
            descriptors.push((declared, descriptor));
        }
        let writes = descriptors.iter().map(|(declared, descriptor)| {
            let write = vk::WriteDescriptorSet::default()
                .dst_binding(declared.binding)
                .descriptor_type(declared.kind);
            match descriptor {
                Descriptor::Buffer(info) => write.buffer_info(info),
                Descriptor::Image(info) => write.image_info(info),
            }
        });
        let mut writes: Vec<_> = writes.collect();
        let point = vk::PipelineBindPoint::COMPUTE;
        self.bind_resources(point, &pass.pipeline, &mut writes)
            .map_err(|e| self.failed(e))
    }

    /// Records `count` workgroups from workgroup `begin` on.
    fn record_groups(
        &self,
        pass: &Pass,
        push: &[u8],
        begin: [u32; 3],
        count: [u32; 3],
    ) -> Result<()> {
        if push.len() != pass.push_bytes as usize {
            return Err(pass.unfit(format!(
                "it takes {} bytes of push constants, not {}",
                pass.push_bytes,
                push.len()
            )));
        }
        let device = &self.frame.device;
        let most = device.most_groups;
        if (0..3).any(|a| begin[a] + count[a] > most[a]) {
            return Err(pass.unfit(format!(
                "it needs {count:?} workgroups from {begin:?} on, but {} runs at most {most:?}",
                device.summary.name
            )));
        }
        let (raw, commands) = self.raw();
        // SAFETY: the command buffer is recording, and the pipeline and its layout are borrowed until its work has ended.
        unsafe {
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, pass.pipeline.raw);
            if !push.is_empty() {
                raw.cmd_push_constants(
                    commands,
                    pass.pipeline.layout,
                    vk::ShaderStageFlags::COMPUTE,
                    0,
                    push,
                );
            }
            let [x, y, z] = count;
            match begin {
                // Synchronization validation (1.3.239) does not see `cmd_dispatch_base`.
                [0, 0, 0] => raw.cmd_dispatch(commands, x, y, z),
                [i, j, k] => raw.cmd_dispatch_base(commands, i, j, k, x, y, z),
            }
        }
        Ok(())
    }

    /// Runs `count` workgroups of `pass` from `begin` on.
    fn dispatch_groups<P: bytemuck::NoUninit>(
        &mut self,
        pass: &'r Pass,
        bindings: &[(&str, Binding<'r>)],
        push: &P,
        begin: [u32; 3],
        count: [u32; 3],
    ) -> Result<()> {
        self.begin_images(bindings.iter().filter_map(|(_, binding)| binding.image()))?;
        self.record_command(
            pass.name,
            CommandKind::Pass,
            vk::PipelineStageFlags2::COMPUTE_SHADER,
            |recording| {
                recording.bind(pass, bindings)?;
                recording.record_groups(pass, bytemuck::bytes_of(push), begin, count)
            },
        )
    }
}

/// Everything that a pass needs in order to run slice after slice.
pub struct Dispatch<'r, P> {
    pub pass: &'r Pass,
    pub bindings: Vec<(&'static str, Binding<'r>)>,
    pub push: P,
    /// At least so many threads run along x, y and z; the shader drops the excess.
    pub threads: [u32; 3],
}

/// Records a slice.
pub type RecordSlice<'a, 'r> = dyn Fn(&mut Recording<'_, 'r>) -> Result<()> + 'a;

impl Frame {
    /// Runs a pass in submissions of its own, slice after slice along the last axis, so that none of them takes much longer
    /// than [`SLICE_MS`] whatever the device: Windows resets a GPU that is busy for two seconds.
    pub fn run_in_slices<P: bytemuck::NoUninit>(
        &mut self,
        dispatch: &Dispatch<'_, P>,
    ) -> Result<()> {
        let mut slices = Slices::new(SLICE_MS);
        while !self.run_slice(dispatch, &mut slices, |recording, slice| slice(recording))? {}
        Ok(())
    }

    /// Runs the next slice of a pass, which `record` records together with what belongs into the same submission. Returns
    /// whether it was the last.
    pub fn run_slice<'r, P: bytemuck::NoUninit>(
        &mut self,
        dispatch: &Dispatch<'r, P>,
        slices: &mut Slices,
        record: impl FnOnce(&mut Recording<'_, 'r>, &RecordSlice<'_, 'r>) -> Result<()>,
    ) -> Result<bool> {
        let Dispatch {
            pass,
            bindings,
            push,
            threads,
        } = dispatch;
        let groups = pass.groups(*threads);
        let axis = if groups[2] > 1 { 2 } else { 1 };
        let rows = Rows {
            all: groups[axis],
            workgroups: groups.iter().product::<u32>() / groups[axis],
            slowest_ms: pass.slowest_ms.get(),
        };
        let (mut begin, mut count) = ([0; 3], groups);
        (begin[axis], count[axis]) = slices.next(rows);
        let began = Instant::now();
        self.run(|recording| {
            record(recording, &|recording| {
                recording.dispatch_groups(pass, bindings, push, begin, count)
            })
        })?;
        let is_last = slices.took(rows, count[axis], began.elapsed());
        if is_last && let Some(ms) = slices.slowest_ms() {
            pass.slowest_ms.set(Some(ms));
        }
        Ok(is_last)
    }
}

/// What is bound to a resource that a shader declares.
enum Descriptor {
    Buffer([vk::DescriptorBufferInfo; 1]),
    Image([vk::DescriptorImageInfo; 1]),
}

impl Descriptor {
    /// Fails where the shader declares something else.
    fn of(
        bound: &Binding<'_>,
        declared: &Resource,
        pass: &Pass,
        device: &Device,
    ) -> Result<Descriptor> {
        let image = |image: &Image, sampler| {
            let info = vk::DescriptorImageInfo::default()
                .sampler(sampler)
                .image_view(image.view())
                .image_layout(vk::ImageLayout::GENERAL);
            Ok(Descriptor::Image([info]))
        };
        match (declared.kind, bound) {
            (vk::DescriptorType::STORAGE_BUFFER, Binding::Buffer(b)) => {
                let info = vk::DescriptorBufferInfo::default()
                    .buffer(b.handle())
                    .range(vk::WHOLE_SIZE);
                Ok(Descriptor::Buffer([info]))
            }
            (vk::DescriptorType::STORAGE_IMAGE, Binding::Image(i))
                if i.desc.written || device.loads_texels && !declared.is_written =>
            {
                image(i, device.nearest)
            }
            (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, Binding::Image(i)) => {
                image(i, device.nearest)
            }
            (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, Binding::Filtered(i)) => {
                image(i, device.linear)
            }
            (vk::DescriptorType::STORAGE_IMAGE, Binding::Image(i)) => Err(pass.unfit(format!(
                "{} is written, but the image {} is not made for that",
                declared.name, i.desc.name
            ))),
            (kind, _) => Err(pass.unfit(format!(
                "{} is declared as {kind:?}, and something else is bound to it",
                declared.name
            ))),
        }
    }
}

/// Fails where something is bound that the shader does not declare.
fn check_names(pass: &Pass, bindings: &[(&str, Binding<'_>)]) -> Result<()> {
    let declared = || pass.resources.iter().map(|resource| resource.name.as_str());
    match bindings
        .iter()
        .find(|(name, _)| !declared().any(|n| n == *name))
    {
        None => Ok(()),
        Some((name, _)) => {
            let declared: Vec<_> = declared().collect();
            Err(pass.unfit(format!(
                "the shader has no {name}, only {}",
                declared.join(", ")
            )))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{DeviceChoice, Format, ImageDesc, Memory, PassDesc, Shaders};

    const WRITES: &str = "#version 460
        layout(local_size_x = 1) in;
        layout(r32f) writeonly uniform image2D texels;
        void main() { imageStore(texels, ivec2(0), vec4(1.0)); }";

    /// A CPU's driver would write there: its images are storage images, so that shaders can load their texels.
    #[test]
    fn an_image_is_written_only_if_it_is_made_for_that() {
        let device = Device::open(&DeviceChoice::default()).expect("a Vulkan device");
        let memory = Memory::new(&device, 1 << 20).expect("memory");
        let shaders = Shaders::new(String::new()).with_file("writes.comp", WRITES);
        let desc = PassDesc {
            name: "writes",
            specialization: &[],
            push: "",
            macros: &[],
        };
        let pass = Pass::new(&device, &shaders, &desc).expect("a pass");
        let mut frame = Frame::new(&device).expect("a frame");
        let mut write = |desc: ImageDesc| {
            let image = Image::new(&memory, desc.zeroed()).expect("an image");
            let bindings = [("texels", Binding::Image(&image))];
            frame.run(|recording| recording.dispatch(&pass, &bindings, &(), [1; 3]))
        };
        let desc = ImageDesc::flat("read", [1, 1], Format::R32_SFLOAT);
        let error = write(desc).expect_err("an image that shaders only read");
        let expected = "texels is written, but the image read is not made for that";
        assert!(error.to_string().contains(expected), "{error}");
        write(desc.written()).expect("a written image");
    }
}
