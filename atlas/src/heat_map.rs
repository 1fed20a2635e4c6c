//! Heat maps of errors.
