#pragma once

/// All of `farfield::farfield`. The components io, opengl and eval have headers of their own.

#include <farfield/core/assert.hpp>
#include <farfield/core/error.hpp>
#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/calibrate.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/gpu/geometry_source.hpp>
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_rules.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/image/atlas.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/image/position_picture.hpp>
#include <farfield/image/region.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/math/plane.hpp>
#include <farfield/math/view.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/outcome.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/policy/amortization.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/policy/image_budget.hpp>
#include <farfield/policy/lifespan.hpp>
#include <farfield/scene/scene.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>
