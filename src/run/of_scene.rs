//! A run of all that a scene asks for.

use super::opened::{Opened, Pace};
use super::running::{Run, RunOptions};
use super::several::Several;
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result};
use crate::scene_file::SceneFile;
use crate::setup::{FilesRead, Input, Setup, Tell};
use crate::sink::{SinkSpec, SinkTarget};

impl Run {
    /// A run of all that `scene` asks for: what it reads is open, and so are its sinks. `tell` gets lines about what was found out.
    ///
    /// A recording is played as fast as possible unless the scene says otherwise, and nothing is written where it names no sink.
    ///
    /// ```
    /// use somatic::run::{Run, Tell};
    /// use somatic::scene::file::SceneFile;
    ///
    /// # let folder = tempfile::tempdir().unwrap();
    /// # let file = folder.path().join("palm.toml");
    /// # std::fs::write(&file, "fields = \"hand/palm\"\nsink = \"ndjson:palm.ndjson\"").unwrap();
    /// let mut run = Run::of(SceneFile::load(&file)?, &Tell::new(|line| eprintln!("{line}")))?;
    /// // `()` watches nothing; an `Observer` of your own sees every call, and may end the run.
    /// let ending = run.run(&mut (), || false)?;
    /// let outcome = run.finish(ending)?;
    /// println!("{} frames, lost: {:?}", outcome.frames, outcome.losses);
    /// # assert!(outcome.frames > 0 && outcome.losses.is_empty() && folder.path().join("palm.ndjson").exists());
    /// # Ok::<(), somatic::Error>(())
    /// ```
    ///
    /// # Errors
    /// Something that the scene names is invalid or not there, an output exists and `overwrite` is not set, or it asks for a
    /// tolerance or a budget, for which the command measures.
    pub fn of(scene: SceneFile, tell: &Tell) -> Result<Self> {
        if !scene.accuracy.target().is_empty() {
            let what = "tolerances and a budget are met by measuring; `somatic tradeoff --write` measures, and writes into a scene what to \
                        give in their place";
            return Err(Error::usage(what).at("[accuracy]"));
        }
        let all = Setup::new(scene, tell.clone());
        let several = Several::new(&all)?;
        let setup = several.first().clone();
        let input = Input::named(&setup)?;
        let mut outputs = FilesRead::from_scene(&all, None).outputs(setup.overwrite);
        let table = setup.table_wish(false)?;
        let target = |sink: &SinkSpec| sink.target(&mut outputs, &setup.allow_hosts, table);
        let targets = setup.sinks.iter().map(target).collect::<Result<Vec<SinkTarget>>>()?;
        let pace = Pace::for_input(&setup, &input, false);
        let mut chosen = Options::default();
        let options = |body: &Body| {
            let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
            chosen = setup.options(body, &ids, pace.batch)?;
            Ok((chosen.clone(), None))
        };
        let opened = Opened::new(&setup, &input, input.body(&setup)?, pace, options)?;
        several.check(&opened.body)?;
        let session = several.session(opened.session(&setup, &input, &targets, None)?);
        let sinks = targets.into_iter().map(|target| target.open(&session)).collect::<Result<Vec<_>>>()?;
        sinks.iter().flat_map(|sink| sink.remarks()).for_each(|remark| tell.say(&remark));
        let verify = setup.verify;
        let lines = opened.lines.clone();
        let following = several.following(&opened, &chosen)?;
        let run = opened.start(sinks, &input, &RunOptions { verify, ..RunOptions::default() });
        let mut run = run.followed_by(following);
        run.lines = lines;
        Ok(run)
    }
}
