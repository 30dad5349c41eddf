//! Tables that are there from the start, or, for the web, made on first use.
//!
//! A page loads the decoder before it shows anything: the tables of the entropy coder would be an
//! eighth of its bytes, and take a millisecond to compute.

/// Defines a static array by the `const fn` that computes it.
macro_rules! table {
    ($(#[$about:meta])* $name:ident: [$t:ty; $n:expr] = $make:ident) => {
        $(#[$about])*
        #[cfg(not(target_family = "wasm"))]
        static $name: [$t; $n] = $make();
        #[cfg(target_family = "wasm")]
        static $name: std::sync::LazyLock<[$t; $n]> = std::sync::LazyLock::new($make);
    };
}

pub(crate) use table;
