//! Authoring: placing taxels on a surface and growing fields over them.
