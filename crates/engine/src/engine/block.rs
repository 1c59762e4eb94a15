//! Frames in one slice: computed where they lie.

use super::Engine;
use super::input::Input;
use crate::backend::Delivered;
use crate::error::{Error, Result};
use crate::percept::Percepts;
use crate::signal::{Frame, FrameBlock};

impl Engine {
    /// What [`Engine::process`] does, for frames whose values lie in one slice: they are read where they are.
    ///
    /// ```
    /// # mod somatic { pub use somatic_bodies as bundled; pub use somatic_engine::{Engine, Options, percept::TouchFrame, scene::Scene, touch}; pub use somatic_skin::{body::Body, error::Result, signal, signal::RawValue}; }
    /// # fn main() -> somatic::Result<()> {
    /// use somatic::signal::FrameBlock;
    /// use somatic::{Body, Engine, Options, RawValue, bundled};
    ///
    /// let body = Body::from_bytes("hand", bundled::HAND)?;
    /// let mut engine = Engine::new(&body, Options::default())?;
    /// let values = vec![RawValue::new(1.0); 2 * body.taxels.len()];
    /// let percepts = engine.process_block(&FrameBlock { t_s: &[0.0, 0.01], values: &values, poses: &[] })?;
    /// assert_eq!(percepts.frames(), 2);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Engine::process`]; and the block has other numbers of values or poses than its frames take.
    pub fn process_block(&mut self, block: &FrameBlock<'_>) -> Result<&Percepts> {
        self.advance_block(block, |engine, input| engine.advance(input, None, None).map(drop))?;
        Ok(&self.percepts)
    }

    /// The same in parts of about a tenth of a second. After each, `go_on` gets the number of frames that are done and says
    /// whether to go on; if not, there are no percepts, and the engine is where it was before the call.
    ///
    /// # Errors
    /// As [`Engine::process_block`].
    pub fn process_block_while(
        &mut self,
        block: &FrameBlock<'_>,
        mut go_on: impl FnMut(usize) -> bool,
    ) -> Result<Option<&Percepts>> {
        let before = self.state()?;
        let mut is_whole = false;
        let advanced = self.advance_block(block, |engine, input| {
            is_whole = engine.advance(input, None, Some(&mut go_on))?;
            Ok(())
        });
        if !is_whole {
            let restored = self.restore(&before);
            advanced.and(restored)?;
            return Ok(None);
        }
        Ok(Some(&self.percepts))
    }

    /// The percepts of the last call, to keep. `spare`, percepts that this engine gave before and nobody needs any more, lends
    /// the next call its memory; without it, that allocates its own.
    pub fn take_percepts(&mut self, spare: Option<Percepts>) -> Percepts {
        let next = spare.filter(|spare| spare.is_like(&self.percepts)).unwrap_or_else(|| self.percepts.empty_like());
        self.check = None;
        std::mem::replace(&mut self.percepts, next)
    }

    fn advance_block(
        &mut self,
        block: &FrameBlock<'_>,
        advance: impl FnOnce(&mut Self, Input<'_>) -> Result<()>,
    ) -> Result<()> {
        let (frames, width) = (block.t_s.len(), self.intake.width());
        if block.values.len() != frames * width {
            return Err(Error::failed(format!(
                "there are {} values, and {frames} frames of {width} values take {}",
                block.values.len(),
                frames * width
            )));
        }
        if let Some((link, poses)) = block.poses.iter().find(|(_, poses)| poses.len() != frames) {
            return Err(Error::failed(format!("link `{link}` has {} poses for {frames} frames", poses.len())));
        }
        self.check = None;
        let mut heads = std::mem::take(&mut self.heads);
        heads.truncate(frames);
        heads.resize_with(frames, Frame::default);
        for (index, (head, &t_s)) in heads.iter_mut().zip(block.t_s).enumerate() {
            head.t_s = t_s;
            head.pose.clear();
            head.pose.extend(block.poses.iter().map(|(link, poses)| (link.clone(), poses[index])));
        }
        let values = Delivered::Flat { values: block.values, width };
        let advanced = advance(self, Input { frames: &heads, values });
        self.heads = heads;
        advanced
    }
}
