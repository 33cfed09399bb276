//! wire_io
