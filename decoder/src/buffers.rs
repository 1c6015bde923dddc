//! Memory that blocks leave to the blocks after them: fresh memory costs more than what is done with it.

use crate::components::Pair;
use crate::frame_memory::FrameMemory;
use crate::interrupt::Interrupt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What has been left last to be used again, or something new.
pub(crate) fn left_or_new<T: Default>(left: &mut Vec<T>) -> T {
    left.pop().unwrap_or_default()
}

/// Memory of the blocks of a task.
#[derive(Debug, Default)]
pub struct Buffers {
    planes: Vec<Vec<i32>>,
    pub(crate) deltas: Vec<u64>,
    pub(crate) components: Vec<Vec<Pair>>,
    /// Ends the work on these blocks.
    pub(crate) interrupt: Interrupt,
}

impl Buffers {
    /// A plane of so many values, which mean nothing.
    pub(crate) fn plane(&mut self, count: usize) -> Vec<i32> {
        let mut plane = left_or_new(&mut self.planes);
        plane.resize(count, 0);
        plane
    }

    /// Takes the memory of a plane.
    pub(crate) fn take(&mut self, plane: Vec<i32>) {
        self.planes.extend(Some(plane).filter(|plane| plane.capacity() > 0));
    }
}

/// Memory that is left of what was decoded before.
#[derive(Debug, Default)]
pub struct BufferPool {
    /// Buffers that no task has: there are as many as tasks have run at a time.
    idle: Mutex<Vec<Buffers>>,
    /// Planes of frames.
    pub(crate) frames: FrameMemory,
}

impl BufferPool {
    /// Without buffers, and with memory of frames.
    pub(crate) fn new(frames: FrameMemory) -> Self {
        Self { idle: Mutex::default(), frames }
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Buffers>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What tasks that decode blocks share.
#[derive(Debug, Clone, Copy)]
pub struct Workspace<'w> {
    /// Their memory.
    pub buffers: &'w BufferPool,
    /// Ends them.
    pub interrupt: &'w Interrupt,
}

impl Workspace<'_> {
    /// Runs a task with buffers of its own.
    pub(crate) fn run<R>(&self, task: impl FnOnce(&mut Buffers) -> R) -> R {
        let mut buffers: Buffers = left_or_new(&mut self.buffers.idle());
        buffers.interrupt = self.interrupt.clone();
        let result = task(&mut buffers);
        self.buffers.idle().push(buffers);
        result
    }
}
