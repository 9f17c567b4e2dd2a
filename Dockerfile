# An image of the command with compiled kernels: docker build -t dloftbs .
FROM python:3.12-slim
COPY . /src
RUN pip install --no-cache-dir "/src[headless]" && rm -r /src
# Kernels for any processor of this architecture. Without this line they are faster, and serve only the kind of
# processor that the image was built on.
ENV NUMBA_CPU_NAME=generic
# Compiled by root beside the package, where every user can read them.
RUN dloftbs warmup
USER nobody
ENTRYPOINT ["dloftbs"]
