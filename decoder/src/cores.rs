//! Work on all cores, where there is enough of it.
//!
//! Who calls a decoder is mostly none of the threads that share its work. To hand something to these and to wait for it
//! takes longer than all that a small frame needs, so that what is little is done where it comes up.

use crate::interrupt::Interrupt;
use core::cmp::Reverse;
use rayon::prelude::*;

/// Modules for web pages have one thread, and no code for more.
pub(crate) const HAS_THREADS: bool = cfg!(not(target_family = "wasm"));

/// Values of Gaussians that are done with before a thread has woken up.
const FEW: usize = 1 << 14;

/// Whether work on so many values is worth other threads.
pub(crate) fn are_many(values: usize) -> bool {
    HAS_THREADS && values > FEW
}

/// Work on so many values that shares parts of itself again and again: by one of the threads that share it, so that it is handed
/// over once and not for each part.
pub(crate) fn whole<R: Send>(values: usize, work: impl FnOnce() -> R + Send) -> R {
    match are_many(values) {
        true => rayon::scope(|_| work()),
        false => work(),
    }
}

/// What `of` makes of each item, in order. All items together have so many values.
pub(crate) fn map<T: Send, R: Send>(
    values: usize,
    items: Vec<T>,
    of: impl Fn(T) -> R + Sync + Send,
) -> Vec<R> {
    match are_many(values) && items.len() > 1 {
        true => items.into_par_iter().map(of).collect(),
        false => items.into_iter().map(of).collect(),
    }
}

/// The same for items that take different times: each comes with what it takes, in any unit. The longest are begun first,
/// so that all cores are done at nearly the same time.
pub(crate) fn map_longest_first<T: Send, R: Send>(
    values: usize,
    items: Vec<(usize, T)>,
    of: impl Fn(T) -> R + Sync + Send,
) -> Vec<R> {
    if !are_many(values) {
        return items.into_iter().map(|(_, item)| of(item)).collect();
    }
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let mut work: Vec<_> = items.into_iter().zip(&mut results).collect();
    work.sort_by_key(|((takes, _), _)| Reverse(*takes));
    let of = &of;
    // What is spawned first is begun first, by whichever thread is free.
    rayon::scope_fifo(|scope| {
        for ((_, item), result) in work {
            scope.spawn_fifo(move |_| *result = Some(of(item)));
        }
    });
    results.into_iter().flatten().collect()
}

/// Works on each item, as long as no interrupt is requested. All items together have so many values.
pub(crate) fn for_each<T: Send>(
    interrupt: &Interrupt,
    values: usize,
    items: impl Iterator<Item = T>,
    work: impl Fn(T) + Sync + Send,
) {
    match are_many(values) {
        true => {
            let items: Vec<T> = items.collect();
            items.into_par_iter().filter(|_| !interrupt.is_requested()).for_each(work);
        }
        false => items.take_while(|_| !interrupt.is_requested()).for_each(work),
    }
}

/// What two pieces of work on so many values give.
pub(crate) fn join<A: Send, B: Send>(
    values: usize,
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    match are_many(values) {
        true => rayon::join(first, second),
        false => (first(), second()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn few_and_many_values_give_the_same_in_order() {
        let squares = |values| map(values, (0..999_u64).collect(), |item| item.pow(2));
        assert_eq!(squares(FEW), squares(FEW + 1));
        assert_eq!(squares(FEW).last(), Some(&998_u64.pow(2)));
        let items =
            |values| map_longest_first(values, (0..999).map(|item| (item % 7, item)).collect(), |item| item);
        assert_eq!([FEW, FEW + 1].map(items), [(); 2].map(|()| (0..999).collect::<Vec<usize>>()));
        let is_shared = |values| whole(values, || rayon::current_thread_index().is_some());
        assert_eq!([FEW, FEW + 1].map(is_shared), [false, true]);
    }

    #[test]
    fn nothing_is_begun_once_an_interrupt_is_requested() {
        for values in [FEW, FEW + 1] {
            let (interrupt, done) = (Interrupt::new(), AtomicUsize::new(0));
            let work = |_| {
                done.fetch_add(1, Ordering::Relaxed);
            };
            for_each(&interrupt, values, 0..99, work);
            interrupt.request();
            for_each(&interrupt, values, 0..99, work);
            assert_eq!(done.into_inner(), 99);
        }
    }
}
