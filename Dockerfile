# Two ways of docs/install.md as images. docker build --target apt -t cable_sim_ros .   (or --target wheels, the default)

# next to a ROS from its distribution
FROM ros:jazzy-ros-base AS apt
SHELL ["/bin/bash", "-ec"]
RUN apt-get update && apt-get install -y --no-install-recommends python3-venv python3-colcon-common-extensions \
    ros-jazzy-visualization-msgs && rm -rf /var/lib/apt/lists/*
WORKDIR /root/tow_ws
COPY . src/cable_sim_ros
RUN source /opt/ros/jazzy/setup.bash && \
    python3 -m venv --system-site-packages --prompt tow .venv && \
    touch .venv/COLCON_IGNORE && \
    .venv/bin/python -m pip install -r src/cable_sim_ros/requirements.txt && \
    .venv/bin/python -m colcon build --packages-select cable_sim_ros
ENTRYPOINT ["/bin/bash", "-c", "source /opt/ros/jazzy/setup.bash && source ~/tow_ws/install/setup.bash && exec \"$@\"", "bash"]
CMD ["ros2", "run", "cable_sim_ros", "node", "--ros-args", "-p", "scene:=full_scale"]

# a wheel with compiled kernels, as make wheel makes it
FROM python:3.12-slim AS kernels
COPY . /tmp/cable_sim_ros
WORKDIR /tmp/cable_sim_ros
RUN python3 -m venv /tmp/made && /tmp/made/bin/python -m pip install --no-cache-dir . && \
    /tmp/made/bin/python -m verification.wheel /tmp/dist

# wheels only
FROM python:3.12-slim AS wheels
COPY --from=kernels /tmp/dist /tmp/dist
RUN python3 -m venv /opt/tow && /opt/tow/bin/python -m pip install --no-cache-dir "$(echo /tmp/dist/*.whl)[ros,viz]"
ENV PATH=/opt/tow/bin:$PATH
WORKDIR /work
CMD ["cable-sim", "live", "nbp1406"]
