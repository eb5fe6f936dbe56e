//! The screen: the window, its images, the picture as it is shown, and the user interface over it. All its memory
//! goes through the same gate as the renderer's.

use std::sync::Arc;
use std::time::Duration;

use egui::{Context, FullOutput, TextureId, Ui, ViewportId};
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::input_runs::input_runs;
use super::planned::Planned;
use super::textures::Textures;
use crate::cli::ViewArgs;
use crate::engine::Host;
use crate::error::{DeviceError, Result};
use crate::gpu::{
    ATLAS_SIDE, Canvas, CanvasMesh, CanvasVertex, Device, Format, Frame, Image, ImageDesc, Memory,
    Shape, Surface, Swapchain,
};
use crate::panic_guard::unless_it_panics;

/// egui's name for the texture of its font.
const FONT: TextureId = TextureId::Managed(0);

/// The colour of the window where there is no picture.
const BACKGROUND: [f32; 3] = [0.07, 0.075, 0.085];

pub struct Stage {
    pub window: Arc<Window>,
    pub host: Host,
    pub memory: Arc<Memory>,
    pub planned: Planned,
    pub frame: Frame,
    pub egui: Context,
    surface: Arc<Surface>,
    input: egui_winit::State,
    images: WindowImages,
    textures: Textures,
    /// Whether the window has changed since its images were made.
    is_outdated: bool,
}

/// The memory of a window.
struct WindowImages {
    swapchain: Swapchain,
    canvas: Canvas,
    /// The picture, encoded for display.
    shown: Image,
}

impl WindowImages {
    fn allocate(
        memory: &Arc<Memory>,
        surface: &Arc<Surface>,
        window: Shape,
        [width, height]: [u32; 2],
    ) -> Result<WindowImages> {
        let shown = ImageDesc::flat("window: picture", [width, height], Format::R8G8B8A8_UNORM)
            .written()
            .zeroed();
        Ok(WindowImages {
            swapchain: Swapchain::new(memory, surface, window)?,
            canvas: Canvas::new(memory, surface)?,
            shown: Image::new(memory, shown)?,
        })
    }
}

impl Stage {
    pub fn open(event_loop: &ActiveEventLoop, args: &ViewArgs) -> Result<Stage> {
        let [width, height] = args.window;
        let attributes = Window::default_attributes()
            .with_title("Isolume")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop
            .create_window(attributes)
            .map_err(|e| DeviceError::Display(format!("no window could be opened: {e}")))?;
        let window = Arc::new(window);
        let options = args.gpu.host_options();
        let surface = Surface::open(&options.device_choice(), window.clone())?;
        let device = surface.device().clone();
        let host = Host::with_device(device.clone(), options.vram_budget, options.ram_budget);
        let memory = host.memory()?;
        let egui = Context::default();
        egui.set_theme(egui::Theme::Dark);
        // Fading in takes a core's time, just when a scene is compiled or a picture moves.
        egui.all_styles_mut(|style| style.animation_time = 0.0);
        let input = egui_winit::State::new(
            egui.clone(),
            ViewportId::ROOT,
            &*window,
            Some(window.scale_factor() as f32),
            None,
            Some(ATLAS_SIDE as usize),
        );
        let frame = Frame::new(&device)?;
        let size = window.inner_size().into();
        let images = WindowImages::allocate(&memory, &surface, surface.shape(size)?, [1, 1])?;
        Ok(Stage {
            window,
            host,
            memory,
            planned: Planned::default(),
            frame,
            egui,
            surface,
            input,
            images,
            textures: Textures::default(),
            is_outdated: false,
        })
    }

    pub fn device(&self) -> &Arc<Device> {
        self.memory.device()
    }

    /// Size in pixels of the picture as it is shown.
    pub fn picture_size(&self) -> [u32; 2] {
        let [width, height, _] = self.images.shown.desc().extent;
        [width, height]
    }

    pub fn shown(&self) -> &Image {
        &self.images.shown
    }

    /// Bytes that the window needs with a picture of this size, once its images have the window's current size.
    pub fn bytes_ahead(&self, picture: [u32; 2]) -> Result<u64> {
        let size = self.size()?;
        let mut shape = self.surface.shape(size)?;
        shape.images = self.images.swapchain.shape().images;
        self.planned_bytes(shape, picture)
    }

    /// Bytes that the window needs as it is: its size may have changed between a plan and its images.
    pub fn bytes_now(&self) -> Result<u64> {
        self.planned_bytes(self.images.swapchain.shape(), self.picture_size())
    }

    fn planned_bytes(&self, window: Shape, picture: [u32; 2]) -> Result<u64> {
        let dry_run = Memory::dry_run(self.device(), self.device().summary.clone());
        WindowImages::allocate(&dry_run, &self.surface, window, picture)?;
        Ok(dry_run.peak())
    }

    /// Makes the window's images anew, at its current size.
    pub fn fit_window(&mut self) -> Result<()> {
        self.is_outdated = false;
        let size = self.size()?;
        self.images.swapchain.resize(size)
    }

    /// Shows pictures of this size from now on; one of another size is lost.
    pub fn resize_picture(&mut self, size: [u32; 2]) -> Result<()> {
        let [width, height] = size;
        if size == self.picture_size() {
            Ok(())
        } else {
            self.images.shown.resize([width, height, 1])
        }
    }

    /// Passes an event to the user interface. Returns whether the interface has to be drawn again.
    pub fn hear(&mut self, event: &winit::event::WindowEvent) -> bool {
        if matches!(event, winit::event::WindowEvent::Resized(_)) {
            self.is_outdated = true;
        }
        self.input.on_window_event(&self.window, event).repaint
    }

    /// Whether the window has no pixels, as when it is minimised.
    pub fn is_hidden(&self) -> Result<bool> {
        Ok(self.size()?.contains(&0))
    }

    /// Size of the window in pixels. winit panics if the display is gone.
    fn size(&self) -> Result<[u32; 2]> {
        match unless_it_panics(|| self.window.inner_size()) {
            Some(size) => Ok(size.into()),
            None => Err(DeviceError::Display("the display has gone away".into()).into()),
        }
    }

    /// Runs the user interface and prepares its drawing. Returns the time after which it has to run again.
    /// `contents` runs once for each of the [`input_runs`]; what the last run draws is shown.
    pub fn run_interface(&mut self, mut contents: impl FnMut(&mut Ui)) -> Result<Duration> {
        let mut output = FullOutput::default();
        for input in input_runs(self.input.take_egui_input(&self.window)) {
            output.append(self.egui.run_ui(input, &mut contents));
        }
        self.input
            .handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let set = std::mem::take(&mut output.textures_delta.set);
        let free = std::mem::take(&mut output.textures_delta.free);
        for (id, deltas) in &set {
            for delta in deltas {
                self.write_texture(*id, delta)?;
            }
        }
        let scale = output.pixels_per_point;
        let primitives = self.egui.tessellate(output.shapes, scale);
        let meshes: Vec<CanvasMesh> = primitives
            .into_iter()
            .filter_map(|primitive| self.mesh(primitive, scale))
            .collect();
        self.images.canvas.fill(&meshes);
        for id in free {
            self.textures.free(id);
        }
        let root = output.viewport_output.get(&ViewportId::ROOT);
        Ok(root.map_or(Duration::MAX, |root| root.repaint_delay))
    }

    /// Writes a texture or a part of it. One for which there is no room is not drawn.
    fn write_texture(&mut self, id: TextureId, delta: &egui::epaint::ImageDelta) -> Result<()> {
        let egui::ImageData::Color(image) = &delta.image;
        let extent = image.size.map(|n| n as u32);
        let begin = match (id, delta.pos) {
            (FONT, _) => Some([0, 0]),
            (_, None) => self
                .textures
                .slot_for(id, extent)
                .map(|texture| texture.low()),
            (_, Some(_)) => self.textures.get(id).map(|texture| texture.low()),
        };
        let Some(begin) = begin else {
            return Ok(());
        };
        let inside = delta.pos.unwrap_or([0, 0]).map(|n| n as u32);
        let low = std::array::from_fn(|a| begin[a] + inside[a]);
        let WindowImages { canvas, .. } = &mut self.images;
        canvas.write_atlas(&mut self.frame, low, extent, image.as_raw())
    }

    /// Triangles of the user interface, from points to pixels and texels.
    fn mesh(&self, primitive: egui::ClippedPrimitive, scale: f32) -> Option<CanvasMesh> {
        let egui::epaint::Primitive::Mesh(mesh) = primitive.primitive else {
            return None;
        };
        let font = self.egui.fonts(|fonts| fonts.font_image_size());
        let texture = match mesh.texture_id {
            FONT => None,
            id => Some(self.textures.get(id)?),
        };
        let clip = primitive.clip_rect;
        let size = self.images.swapchain.shape().extent;
        let pixel = |x: f32, a: usize| ((x * scale).round().max(0.0) as u32).min(size[a]);
        let corner = |p: egui::Pos2| [pixel(p.x, 0), pixel(p.y, 1)];
        let texel = |uv: [f32; 2]| match texture {
            Some(texture) => texture.texel(uv),
            None => std::array::from_fn(|a| uv[a] * font[a] as f32),
        };
        let vertex = |v: &egui::epaint::Vertex| CanvasVertex {
            position: [v.pos.x * scale, v.pos.y * scale],
            uv: texel([v.uv.x, v.uv.y]),
            color: u32::from_le_bytes(v.color.to_array()),
        };
        Some(CanvasMesh {
            clip: [corner(clip.min), corner(clip.max)],
            vertices: mesh.vertices.iter().map(vertex).collect(),
            indices: mesh.indices,
        })
    }

    /// Shows the picture in the rectangle [low, high), in pixels, and the user interface over it. Returns whether
    /// that was presented: a window that has just changed has no image for it.
    pub fn show(&mut self, [low, high]: [[u32; 2]; 2]) -> Result<bool> {
        let WindowImages {
            swapchain,
            canvas,
            shown,
        } = &mut self.images;
        let Some(target) = swapchain.acquire()? else {
            self.is_outdated = true;
            return Ok(false);
        };
        let high = std::array::from_fn(|a| high[a].min(target.extent[a]));
        let [width, height, _] = shown.desc().extent;
        self.frame.run(|recording| {
            recording.open_target(&target, BACKGROUND)?;
            if (0..2).all(|a| low[a] < high[a]) {
                recording.blit(shown, [width, height], &target, [low, high])?;
            }
            recording.draw(canvas, &target)?;
            recording.close_target(&target);
            Ok(())
        })?;
        // On Wayland the next frame is asked for once the compositor wants one. Of a window that nobody sees it may never do so,
        // and presenting would wait for it.
        self.window.pre_present_notify();
        self.is_outdated |= !target.present()?;
        Ok(true)
    }

    /// Whether the window's images have to be made anew before the next frame.
    pub fn is_outdated(&self) -> bool {
        self.is_outdated
    }
}
