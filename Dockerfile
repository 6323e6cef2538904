# stribeck with simulation; alone it runs the demonstration:
#   docker build -t stribeck .
#   docker run --rm --user "$(id -u)" -v "$PWD:/work" stribeck                 writes demo/ here
#   docker run --rm --user "$(id -u)" -v "$PWD:/work" stribeck identify log.npz -r robot.toml -o out
FROM python:3.11-slim

# What was tested together; then the package itself, without its sources.
WORKDIR /source
COPY pyproject.toml README.md LICENSE requirements.lock ./
COPY src src
RUN pip install --no-cache-dir --disable-pip-version-check -c requirements.lock '.[simulation]' && rm -rf /source

# Nothing here has a screen; caches go where any user may write.
ENV MUJOCO_GL=off MPLCONFIGDIR=/tmp/matplotlib
RUN useradd --create-home stribeck && install --directory --owner=stribeck /work
USER stribeck
WORKDIR /work
ENTRYPOINT ["stribeck"]
CMD ["demo"]
