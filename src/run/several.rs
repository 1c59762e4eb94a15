//! Several recordings that are run one after the other, into the same tables. Each begins from a state of its own: motion, identities and
//! numbers of frames end with it.

use std::sync::Arc;

use super::opened::{Opened, Pace};
use super::running::{Begun, Following};
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result, failed};
use crate::recording::SCENE;
use crate::setup::{Input, Setup};
use crate::signal::Quantity;
use crate::sink::{FieldNames, Session, SkinNames};

/// What is asked of each recording, if there are several; else of the source.
pub struct Several {
    each: Vec<Setup>,
    /// What people call each of several recordings; empty for one.
    names: Vec<String>,
    /// All of them.
    title: String,
}

/// What all recordings have in common.
struct Common {
    first: String,
    fields: Vec<FieldNames>,
    skin: Option<SkinNames>,
    quantity: Option<Quantity>,
    options: Options,
    pace: Pace,
    /// The body, if it is named: that of all.
    body: Option<Body>,
}

impl Several {
    /// What `setup` asks for.
    ///
    /// # Errors
    /// A source cannot be named.
    pub fn new(setup: &Setup) -> Result<Self> {
        let each = setup.each();
        let (mut names, mut title) = (Vec::new(), String::new());
        if each.len() > 1 {
            names = each.iter().map(|one| Ok(Input::named(one)?.name)).collect::<Result<Vec<String>>>()?;
            title = format!("{} recordings", names.len());
        }
        Ok(Self { each, names, title })
    }

    /// What is asked of the first one.
    #[must_use]
    pub fn first(&self) -> &Setup {
        &self.each[0]
    }

    /// What people call all of them; `name` if that is one.
    #[must_use]
    pub fn title<'a>(&'a self, name: &'a str) -> &'a str {
        if self.names.is_empty() { name } else { &self.title }
    }

    /// The `session` of the first one as that of all.
    #[must_use]
    pub fn session<'a>(&'a self, mut session: Session<'a>) -> Session<'a> {
        session.source = self.title(session.source);
        session.recordings = &self.names;
        if !self.names.is_empty() && self.first().body.is_none() {
            // Each has a body of its own.
            session.attached.retain(|(name, ..)| name == SCENE);
        }
        session
    }

    /// Refuses a recording after the first one that cannot be opened, or that does not fit the `body` of the first one: before any
    /// frame is read.
    ///
    /// # Errors
    /// One of them does not.
    pub fn check(&self, body: &Body) -> Result<()> {
        for one in &self.each[1..] {
            let one = one.unheard();
            let input = Input::named(&one)?;
            // One that is named is that of all.
            if one.body.is_none() && !are_alike(&input.body(&one)?, body) {
                return Err(other_sensors(&self.names[0]).at(&input.name));
            }
            drop(input.open(&ids(body), &one)?);
        }
        Ok(())
    }

    /// The recordings after the first one, which is `opened`, with the `options` of that.
    ///
    /// # Errors
    /// The backend has no name, which would be a defect.
    pub fn following(self, opened: &Opened, options: &Options) -> Result<Vec<Following>> {
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let plan = opened.engine.plan();
        let common = Arc::new(Common {
            first: self.names[0].clone(),
            fields: FieldNames::all_of(plan),
            skin: SkinNames::for_plan(&opened.body, plan),
            quantity: plan.common_quantity(),
            // What was chosen for the first one is not chosen anew.
            options: options.clone().backend(opened.engine.backend().name.parse()?),
            pace: opened.pace,
            body: self.first().body.is_some().then(|| opened.body.clone()),
        });
        let following = self.each.into_iter().zip(self.names).skip(1).map(|(setup, name)| {
            let common = Arc::clone(&common);
            Following { name, begin: Box::new(move || common.begin(&setup)) }
        });
        Ok(following.collect())
    }
}

impl Common {
    /// Opens the recording that `setup` asks for, and starts to read it.
    fn begin(&self, setup: &Setup) -> Result<Begun> {
        let input = Input::named(setup)?;
        let body = self.body.clone().map_or_else(|| input.body(setup), Ok)?;
        let with_own_calibration = |body: &Body| {
            let own = setup.options(body, &ids(body), self.pace.batch)?;
            Ok((self.options.clone().calibration(own.calibration), None))
        };
        let opened = Opened::new(setup, &input, body, self.pace, with_own_calibration)?;
        self.check(&opened).map_err(|e| e.at(&input.name))?;
        let taxels = opened.source.taxels().to_vec();
        let (engine, feed) = opened.read();
        Ok(Begun { engine, feed, taxels })
    }

    /// Refuses what makes other columns than the first one.
    fn check(&self, opened: &Opened) -> Result<()> {
        let plan = opened.engine.plan();
        if FieldNames::all_of(plan) != self.fields || SkinNames::for_plan(&opened.body, plan) != self.skin {
            return Err(other_sensors(&self.first));
        }
        let unit = |quantity: Option<Quantity>| match quantity {
            None => "of several units",
            Some(Quantity::Count) => "a count",
            Some(quantity) => quantity.symbol(),
        };
        let (own, first) = (plan.common_quantity(), self.quantity);
        if own != first {
            return Err(failed!(
                "P is {} here and {} in {}; give the unit in a `calibration`, or run it on its own",
                unit(own),
                unit(first),
                self.first
            ));
        }
        Ok(())
    }
}

/// Whether they have the same taxels, links and fields, wherever these are.
fn are_alike(one: &Body, other: &Body) -> bool {
    let names = |body: &Body| {
        let links: Vec<String> = body.links.iter().map(|link| link.name.clone()).collect();
        let fields: Vec<String> = body.fields.iter().map(|field| field.name.clone()).collect();
        (links, fields)
    };
    ids(one) == ids(other) && names(one) == names(other)
}

fn ids(body: &Body) -> Vec<u32> {
    body.taxels.iter().map(|taxel| taxel.id).collect()
}

fn other_sensors(first: &str) -> Error {
    failed!("its sensors or their fields are not those of {first}; give one `body` for both, or run it on its own")
}
