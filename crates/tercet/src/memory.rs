//! What the system's allocator does with memory that is freed.

/// The largest array of a level, in bytes for each of its vertices: two faces of three corners.
const LARGEST_ARRAY: u64 = 24;

/// Beyond this glibc's threshold does not rise; what an allocator adds to a block is less than the difference.
const MOST: u64 = (32 << 20) - (1 << 16);

/// Prepares for levels of up to so many vertices, each of which frees the arrays of the one before and asks for larger
/// ones. Touches no memory, asks for a quarter of `max_memory` at most, and does without if that is refused.
///
/// The allocator of glibc gives arrays beyond a threshold back to the system as soon as they are freed, so that the
/// pages of every level would be asked for, cleared and mapped anew, an eighth of a fast decoder's time. The threshold
/// follows the largest block that has been freed (mallopt(3), `M_MMAP_THRESHOLD`), and one that was never touched costs
/// nothing. Elsewhere it does nothing.
pub(crate) fn keep(vertices: u64, max_memory: u64) {
    if cfg!(all(target_os = "linux", target_env = "gnu")) {
        let bytes = (vertices * LARGEST_ARRAY).min(MOST).min(max_memory / 4) as usize;
        let mut block = Vec::<u8>::new();
        // Refused: then levels are a little slower, if they fit at all.
        let _ = block.try_reserve_exact(bytes);
        drop(std::hint::black_box(block));
    }
}
