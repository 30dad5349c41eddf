//! What the system's allocator does with memory that is freed.

/// The largest array of a level, in bytes for each of its vertices: two faces of three corners.
const LARGEST_ARRAY: u64 = 24;

/// Beyond this glibc's threshold does not rise; what an allocator adds to a block is less than the difference.
const MOST: u64 = (32 << 20) - (1 << 16);

/// Prepares for levels of up to so many vertices, each of which frees the arrays of the one before and asks for larger
/// ones.
///
/// The allocator of glibc gives arrays beyond a threshold back to the system as soon as they are freed, so that the
/// pages of every level would be asked for, cleared and mapped anew, an eighth of a fast decoder's time. The threshold
/// follows the largest block that has been freed (mallopt(3), `M_MMAP_THRESHOLD`), and one that was never touched costs
/// nothing. Elsewhere it does nothing.
pub(crate) fn keep(vertices: u64) {
    if cfg!(all(target_os = "linux", target_env = "gnu")) {
        let bytes = (vertices * LARGEST_ARRAY).min(MOST) as usize;
        drop(std::hint::black_box(Vec::<u8>::with_capacity(bytes)));
    }
}
