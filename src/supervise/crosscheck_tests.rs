//! Each check at its threshold, with the noise that it must bear.
