//! Timestamps, a pair a pass, and invocations of fragment shaders.

use std::sync::Arc;

use ash::vk;

use super::{Device, check};

/// A pool of timestamp pairs for one frame slot.
pub struct Timestamps {
    raw: vk::QueryPool,
    pairs: u32,
    period: f64,
    // Which bits of a stamp count: none where the queue has no clock, and then nothing is
    // stamped and every time is none.
    mask: u64,
    device: Arc<Device>,
}

impl Timestamps {
    /// Makes room for `pairs` pairs.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(device: &Arc<Device>, name: &str, pairs: u32) -> super::Result<Self> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * pairs);
        // SAFETY: the device is alive.
        let raw = check("vkCreateQueryPool", unsafe {
            device.raw.create_query_pool(&info, None)
        })?;
        device.name(raw, name);
        let period = f64::from(device.candidate().limits.timestamp_period);
        let mask = match device.candidate().timestamp_bits {
            64.. => u64::MAX,
            bits => (1 << bits) - 1,
        };
        Ok(Timestamps {
            raw,
            pairs,
            period,
            mask,
            device: Arc::clone(device),
        })
    }

    /// Forgets all stamps; to be recorded before the first of a frame.
    pub fn reset(&self, commands: vk::CommandBuffer) {
        // SAFETY: `commands` is being recorded outside a render pass.
        unsafe {
            self.device
                .raw
                .cmd_reset_query_pool(commands, self.raw, 0, 2 * self.pairs)
        };
    }

    /// Stamps the start of pair `pair`.
    pub fn start(&self, commands: vk::CommandBuffer, pair: u32) {
        self.stamp(commands, 2 * pair);
    }

    /// Stamps the end of pair `pair`.
    pub fn end(&self, commands: vk::CommandBuffer, pair: u32) {
        self.stamp(commands, 2 * pair + 1);
    }

    fn stamp(&self, commands: vk::CommandBuffer, query: u32) {
        if self.mask == 0 {
            return;
        }
        // Both ends wait for all earlier work, so that neighbouring pairs do not overlap.
        let stage = vk::PipelineStageFlags2::BOTTOM_OF_PIPE;
        // SAFETY: `commands` is being recorded and the pool was reset before.
        unsafe {
            self.device
                .raw
                .cmd_write_timestamp2(commands, stage, self.raw, query)
        };
    }

    /// Milliseconds between the stamps of pair `pair`; none where it was not stamped.
    ///
    /// To be called once the frame's fence has signalled.
    pub fn milliseconds(&self, pair: u32) -> Option<f64> {
        // Value and availability of both stamps.
        let mut data = [[0u64; 2]; 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the pool is alive and the range within it.
        let result = unsafe {
            self.device
                .raw
                .get_query_pool_results(self.raw, 2 * pair, &mut data, flags)
        };
        let [[start, has_start], [end, has_end]] = data;
        (result.is_ok() && has_start != 0 && has_end != 0)
            .then(|| (end.wrapping_sub(start) & self.mask) as f64 * self.period * 1e-6)
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the pool.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}

/// A pool of pipeline statistics for one frame slot: how often fragment shaders ran, where the device counts that.
///
/// Only of draws: on lavapipe a query of compute invocations crashes where no compute pipeline was bound before it, and
/// how many invocations a dispatch has is known without.
pub struct Statistics {
    raw: vk::QueryPool,
    queries: u32,
    device: Arc<Device>,
}

impl Statistics {
    /// Makes room for `queries`; none where the device does not count.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(device: &Arc<Device>, name: &str, queries: u32) -> super::Result<Option<Self>> {
        if !device.candidate().statistics {
            return Ok(None);
        }
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .pipeline_statistics(vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS)
            .query_count(queries);
        // SAFETY: the device is alive and has the feature.
        let raw = check("vkCreateQueryPool", unsafe {
            device.raw.create_query_pool(&info, None)
        })?;
        device.name(raw, name);
        Ok(Some(Statistics {
            raw,
            queries,
            device: Arc::clone(device),
        }))
    }

    /// Forgets all counts; to be recorded before the first of a frame.
    pub fn reset(&self, commands: vk::CommandBuffer) {
        // SAFETY: `commands` is being recorded outside a render pass.
        unsafe {
            self.device
                .raw
                .cmd_reset_query_pool(commands, self.raw, 0, self.queries)
        };
    }

    /// Starts query `query`; it must end in the same subpass, or outside a render pass if it starts there.
    pub fn start(&self, commands: vk::CommandBuffer, query: u32) {
        let flags = vk::QueryControlFlags::empty();
        // SAFETY: `commands` is being recorded and the pool was reset before.
        unsafe {
            self.device
                .raw
                .cmd_begin_query(commands, self.raw, query, flags)
        };
    }

    /// Ends query `query`.
    pub fn end(&self, commands: vk::CommandBuffer, query: u32) {
        // SAFETY: the query was started in the same command buffer.
        unsafe { self.device.raw.cmd_end_query(commands, self.raw, query) };
    }

    /// The count of query `query`; none where it did not run. To be called once the frame's fence has signalled.
    pub fn invocations(&self, query: u32) -> Option<u64> {
        let mut data = [[0u64; 2]; 1];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the pool is alive and the query within it.
        let result = unsafe {
            self.device
                .raw
                .get_query_pool_results(self.raw, query, &mut data, flags)
        };
        let [[count, available]] = data;
        (result.is_ok() && available != 0).then_some(count)
    }
}

impl Drop for Statistics {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the pool.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
