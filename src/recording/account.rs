//! What of a file was whole, and what was not.

/// Counts what is whole in a file, and tells what is not.
pub(super) struct Account {
    /// What people call the file.
    name: String,
    /// What is read from it, such as `frame`.
    thing: &'static str,
    /// How many were whole, and the time of the last, s.
    whole: u64,
    last_s: Option<f64>,
    /// Places that are damaged, and bytes that were not read there.
    places: u64,
    bytes: u64,
    /// The times before and after the first of them, s.
    after_s: Option<f64>,
    before_s: Option<f64>,
    losses: Vec<String>,
}

impl Account {
    pub(super) fn new(name: &str, thing: &'static str) -> Self {
        Self {
            name: name.to_owned(),
            thing,
            whole: 0,
            last_s: None,
            places: 0,
            bytes: 0,
            after_s: None,
            before_s: None,
            losses: Vec::new(),
        }
    }

    /// Notes that what is at `t_s` was whole.
    pub(super) fn saw(&mut self, t_s: f64) {
        self.whole += 1;
        self.last_s = Some(t_s);
        if self.places > 0 {
            self.before_s.get_or_insert(t_s);
        }
    }

    /// Notes that `bytes` in one place were not read.
    pub(super) fn damaged(&mut self, bytes: u64) {
        if self.places == 0 {
            self.after_s = self.last_s;
        }
        self.places += 1;
        self.bytes += bytes;
    }

    /// Tells that the file ends before its end, in `bytes` that are no whole chunk.
    pub(super) fn tell_cut(&mut self, bytes: u64) {
        let what = if bytes > 0 { format!("; {bytes} bytes of an incomplete chunk") } else { String::new() };
        let missing = match self.last_s {
            Some(t_s) => format!("what came after t = {t_s} s is missing"),
            None => format!("it has no complete {}", self.thing),
        };
        self.losses.push(format!("{}: it is cut off: {missing}{what}", self.name));
    }

    /// Tells of the damage, when nothing more comes; call it once.
    pub(super) fn end(&mut self) {
        let Self { name, thing, places, bytes, .. } = self;
        if *places == 0 {
            return;
        }
        let places = if *places == 1 { "one place".to_owned() } else { format!("{places} places, the first") };
        let when = match (self.after_s, self.before_s) {
            (Some(after), Some(before)) => format!("between t = {after} s and t = {before} s"),
            (Some(after), None) => format!("after t = {after} s"),
            (None, Some(before)) => format!("before t = {before} s"),
            (None, None) => format!("before any {thing}"),
        };
        let intact = match self.whole {
            0 => format!("no {thing} is whole"),
            1 => format!("1 {thing} is whole"),
            whole => format!("{whole} {thing}s are intact"),
        };
        self.losses.push(format!("{name}: damaged in {places} {when}: {bytes} bytes not read, {intact}"));
    }

    /// What was told, in a line each.
    pub(super) fn losses(&self) -> &[String] {
        &self.losses
    }
}
