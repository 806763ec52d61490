"""A corridor folded into lanes, to measure how planning time grows with the length of the path."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import WALL, make_rectangle
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_WIDTH = 1.5  # m


@dataclass(frozen=True)
class Corridor(Drawn):
    """Lanes of 8 m side by side, joined at alternating ends; fins from random sides make the lanes wind."""

    length: float = parameter(40.0, "length of the corridor's middle line", unit="m", low=10.0, high=300.0)
    fin: float = parameter(0.4, "share of the width that a fin takes; 0 for smooth walls", low=0.0, high=0.9)

    def draw(self, rng: np.random.Generator) -> World:
        lane_pitch = _WIDTH + WALL
        lane_count = max(1, round(self.length / (8.0 - _WIDTH + lane_pitch)))
        # the middle line: straight runs of lane - width, and a step of one pitch between two lanes
        run_length = (self.length - (lane_count - 1) * lane_pitch) / lane_count
        lane_length = run_length + _WIDTH
        polygons = []
        for k in range(1, lane_count):
            y = k * lane_pitch - WALL
            x_left, x_right = (0.0, run_length) if k % 2 else (_WIDTH, lane_length)
            polygons.append(make_rectangle(x_left, y, x_right, y + WALL))
        for k in range(lane_count):
            bottom, top = k * lane_pitch, k * lane_pitch + _WIDTH
            reach = self.fin * _WIDTH
            x = _WIDTH + rng.uniform(0.5, 1.5)
            while reach > 0.0 and x < lane_length - _WIDTH - 0.5:
                is_low = rng.random() < 0.5
                polygons.append(
                    make_rectangle(x, bottom if is_low else top - reach, x + WALL, bottom + reach if is_low else top)
                )
                x += rng.uniform(1.2, 2.5) * _WIDTH
        half_width = _WIDTH / 2.0
        goal_x = lane_length - half_width if lane_count % 2 else half_width
        return World(
            name="corridor",
            start=(half_width, half_width, draw_random_yaw(rng)),
            goal=(goal_x, (lane_count - 1) * lane_pitch + half_width),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, lane_length, lane_count * lane_pitch - WALL),
            timeout=60.0 * self.length / 10.0,  # for a mean speed of 0.17 m/s along the middle line
        )
